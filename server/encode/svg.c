#include "server/encode/svg.h"

#include <math.h>

const char svg_type[] = "image/svg+xml";

// Okabe and Ito's colours, which most eyes tell apart, and some more; lighter ones for a dark page.
static const char *const light[SVG_COLOURS] = {"#0072b2", "#d55e00", "#009e73", "#a8509a",
                                               "#8a6d00", "#444444", "#b0003a", "#3f51b5",
                                               "#4b7f00", "#1f8fc4", "#994f00", "#006d6d"};
static const char *const dark[SVG_COLOURS] = {"#56b4e9", "#f0944d", "#3ad1a4", "#e29ad0",
                                              "#e6c23c", "#c8c8c8", "#ff7a9c", "#9fa8ff",
                                              "#a5d65a", "#8fd0f5", "#d9a066", "#5fd0d0"};

static void put_colours(Bytes *bytes, const char *const colours[SVG_COLOURS]) {
    for (size_t i = 0; i < SVG_COLOURS; i++)
        bytes_format(bytes, ".line.s%zu { stroke: %s; } .band.s%zu, .mark.s%zu { fill: %s; }\n", i,
                     colours[i], i, i, colours[i]);
}

void svg_open(Bytes *bytes, double width, double height, const char *title) {
    bytes_format(bytes,
                 "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %.0f %.0f\" "
                 "role=\"img\">\n<title>",
                 width, height);
    svg_text(bytes, title);
    bytes_text(bytes, "</title>\n");
}

void svg_page(Bytes *bytes, double width, double height, const char *rules) {
    bytes_text(bytes,
               "<style>\n"
               "svg { font: 12px system-ui, sans-serif; color-scheme: light dark; }\n"
               ".grid, .frame, .line, .strong { fill: none; } .heading { font-size: 14px; }\n"
               ".line { stroke-width: 1.5; stroke-linejoin: round; } .band { fill-opacity: 0.4; }\n"
               ".page { fill: #ffffff; } text { fill: #222222; } .faint { fill: #666666; }\n"
               ".grid { stroke: #dddddd; } .frame { stroke: #777777; } "
               ".strong { stroke: #222222; }\n");
    put_colours(bytes, light);
    bytes_text(bytes, "@media (prefers-color-scheme: dark) {\n"
                      ".page { fill: #16181c; } text { fill: #e4e4e4; } .faint { fill: #a0a0a0; }\n"
                      ".grid { stroke: #363a41; } .frame { stroke: #8a8f98; } "
                      ".strong { stroke: #f2f2f2; }\n");
    put_colours(bytes, dark);
    bytes_text(bytes, "}\n");
    bytes_text(bytes, rules != NULL ? rules : "");
    bytes_format(bytes, "</style>\n<rect class=\"page\" width=\"%.0f\" height=\"%.0f\"/>\n", width,
                 height);
}

void svg_close(Bytes *bytes) {
    bytes_text(bytes, "</svg>\n");
}

void svg_heading(Bytes *bytes, double x, double y, const char *text) {
    bytes_format(bytes, "<text class=\"heading\" x=\"%.0f\" y=\"%.0f\">", x, y);
    svg_text(bytes, text);
    bytes_text(bytes, "</text>\n");
}

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
