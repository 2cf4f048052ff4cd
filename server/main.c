// impactd: the daemon and the command line in one program.
#include "core/math/fourier.h"
#include "server/command/command.h"

int main(int argc, char **argv) {
    fourier_start();
    return command_main(argc, argv);
}
