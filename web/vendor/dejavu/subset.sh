#!/bin/sh
# Makes the font of this folder from Debian's packages fonts-dejavu-core (2.37), python3-fonttools and python3-brotli: ASCII, the
# signs of units and of terminals (lines, blocks, Braille), all of one width.
set -e
cd "$(dirname "$0")"
python3 -m fontTools.subset /usr/share/fonts/truetype/dejavu/DejaVuSansMono.ttf --flavor=woff2 --no-hinting \
    --layout-features= --drop-tables+=FFTM \
    --unicodes=U+0020-007E,U+00B0-00B3,U+00B5,U+00B7,U+00D7,U+2013,U+2022,U+2026,U+2190-2193,U+2212,U+2264-2265,U+2500,U+2502,U+250C,U+2510,U+2514,U+2518,U+251C,U+2524,U+252C,U+2534,U+253C,U+2580-2593,U+2800-28FF \
    --output-file=dejavu-sans-mono.woff2
