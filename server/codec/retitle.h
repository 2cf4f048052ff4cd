// Puts a title and labels into a scene's text, whatever else it holds; numbers stay the same
// doubles. Not a reader of scenes. Used by command/submit.c.
#ifndef SERVER_CODEC_RETITLE_H
#define SERVER_CODEC_RETITLE_H

#include "core/base/field.h"
#include "server/base/bytes.h"

// `title` may be NULL; `labels` are "key=value" and come on top of those the scene has. The text is
// replaced; one that is no JSON object stays as it is, for whoever judges it.
Status retitle(Bytes *text, const char *title, const Texts *labels, Problem *problem);

#endif
