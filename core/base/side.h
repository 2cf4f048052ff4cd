// The two stops of a damper. Left is at u = offset - clearance / 2, right at u = offset + clearance
// / 2. Only the name of a side: what stands there is scene/damper.h's, what happens there is
// result/response.h's. Used by scene/, plan/, solve/ and result/.
#ifndef CORE_BASE_SIDE_H
#define CORE_BASE_SIDE_H

typedef enum Side { SIDE_LEFT, SIDE_RIGHT } Side;
extern const char *const side_names[]; // NULL-terminated

#endif
