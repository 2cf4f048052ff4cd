// Where the data lies if nobody says so. Used by the commands `serve`, `token`
// and `backup`.
#ifndef SERVER_COMMAND_DATA_FOLDER_H
#define SERVER_COMMAND_DATA_FOLDER_H

#include "core/base/status.h"

// Sets *folder, where it is NULL, to impactd under $XDG_STATE_HOME, else under ~/.local/state; the
// caller frees it. STATUS_USAGE where neither is known.
Status data_folder_default(char **folder, Problem *problem);

// The same, and IMPACTD_DATA before those: for commands beside the daemon.
Status data_folder_find(char **folder, Problem *problem);

#endif
