// Manual pages and the completion of bash, printed from the tables that the program itself goes by.
// Not part of the program: a tool of the build, run once. Used by main.c beside it.
#ifndef SERVER_INSTALL_PAGES_H
#define SERVER_INSTALL_PAGES_H

#include <stdio.h>

void manual_program(FILE *file); // impactd(1)
void manual_scene(FILE *file);   // impactd-scene(5)
void completion_bash(FILE *file);

#endif
