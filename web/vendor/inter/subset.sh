#!/bin/sh
# Makes the two fonts of this folder from Debian's packages fonts-inter (4.0 beta 7), python3-fonttools and python3-brotli:
# ASCII, a few letters more, Greek, superscripts, arrows and the operators that the dashboard writes.
set -e
cd "$(dirname "$0")"
for weight in Regular SemiBold; do
    python3 -m fontTools.subset "/usr/share/fonts/opentype/inter/Inter-$weight.otf" --flavor=woff2 \
        --no-hinting --desubroutinize --layout-features=tnum \
        --unicodes=U+0020-007E,U+00A0,U+00B0-00B3,U+00B5,U+00B7,U+00B9,U+00C4,U+00D6,U+00D7,U+00DC,U+00DF,U+00E4,U+00E8-00EA,U+00F6,U+00FC,U+0394,U+03A3,U+03A9,U+03B1-03B8,U+03BB-03C6,U+03C9,U+2009,U+2010-2014,U+2018-201E,U+2026,U+2070-2079,U+207B,U+2190-2193,U+2212,U+221A,U+221E,U+2248,U+2260,U+2264-2265,U+25B2,U+25B6,U+25BC,U+25C0 \
        --output-file="inter-$(echo "$weight" | tr '[:upper:]' '[:lower:]').woff2"
done
