#!/bin/sh
# Makes the two fonts of this folder from Debian's packages fonts-inter (4.0 beta 7), python3-fonttools and python3-brotli:
# Latin, Greek, superscripts, subscripts, arrows and the operators that the dashboard writes.
set -e
cd "$(dirname "$0")"
for weight in Regular SemiBold; do
    python3 -m fontTools.subset "/usr/share/fonts/opentype/inter/Inter-$weight.otf" --flavor=woff2 \
        --layout-features=kern,tnum \
        --unicodes=U+0020-007E,U+00A0-00FF,U+0391-03A9,U+03B1-03C9,U+2009,U+2010-2015,U+2018-201E,U+2022,U+2026,U+2032-2033,U+2070-2079,U+207B,U+2080-208E,U+2190-2193,U+2206,U+2211,U+2212,U+221A,U+221E,U+2248,U+2260,U+2264-2265,U+25B2,U+25B6,U+25BC,U+25C0,U+25CF \
        --output-file="inter-$(echo "$weight" | tr '[:upper:]' '[:lower:]').woff2"
done
