#include "server/encode/svg.h"

#include <math.h>

const char svg_type[] = "image/svg+xml";

void svg_text(Bytes *bytes, const char *text) {
    for (const char *c = text; *c != '\0'; c++) {
        if (*c == '&')
            bytes_text(bytes, "&amp;");
        else if (*c == '<')
            bytes_text(bytes, "&lt;");
        else if (*c == '>')
            bytes_text(bytes, "&gt;");
        else if (*c == '"')
            bytes_text(bytes, "&quot;");
        else
            bytes_put(bytes, (unsigned char)*c < ' ' ? " " : c, 1);
    }
}

void svg_power(Bytes *bytes, int decade) {
    if (decade >= -1 && decade <= 3)
        bytes_format(bytes, "%g", pow(10, decade));
    else
        bytes_format(bytes, "10<tspan dy=\"-5\" font-size=\"9\">%d</tspan>", decade);
}

void svg_decades(double least, double most, int *from, int *to) {
    *from = (int)floor(log10(least));
    *to = (int)ceil(log10(most));
    if (*to <= *from)
        *to = *from + 1;
}
