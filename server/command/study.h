// What commands that make a study share: the scene is read, the study made as the daemon makes it,
// the answer printed and written to files. Not a command. Used by tradeoff.c and ensemble.c.
#ifndef SERVER_COMMAND_STUDY_H
#define SERVER_COMMAND_STUDY_H

#include "core/study/study.h"
#include "server/command/command.h"

enum { STUDY_OUTPUTS = 8 }; // files of one command

typedef struct StudyCommand {
    const StudyKind *kind; // NULL: the document's own study, whatever it is; it must have one
    // Puts what the flags say into the document's own study of this kind, or into a new one; may
    // take what `settings` own. NULL: the document alone counts, and nothing is printed where files
    // are written.
    void (*choose)(void *study, void *settings);
    void (*print)(const Variant *answer); // on standard output, for people
} StudyCommand;

// Does the whole for the one scene among the operands, with a file for each of `outputs`, within
// the CPU seconds that a scene may take. Returns the exit code.
int study_command_run(const Command *self, const StudyCommand *command, const Texts *outputs,
                      double cpu_seconds, void *settings, const Options *options, Problem *problem);

// A number for a table's cell, "-" where it is not known.
const char *study_number(char text[24], const char *format, double value);

#endif
