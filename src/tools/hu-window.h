/* hu-window.h: windows of HU by name. Pure.
 *
 * Width and level are those of the article "Windowing (CT)" of Radiopaedia.org: brain 80 at 40,
 * stroke 40 at 40, temporal bones 2800 at 600, lungs 1500 at -600, mediastinum 350 at 50, soft
 * tissues (abdomen) 400 at 50, liver 150 at 30, soft tissues of the spine 250 at 50, bone 1800 at
 * 400. A window reaches from level - width / 2 to level + width / 2.
 */
#ifndef CT_TOOLS_HU_WINDOW_H
#define CT_TOOLS_HU_WINDOW_H
#include "core/err.h"

#include <stdbool.h>

/* X(name, width, level) */
#define HU_WINDOW_LIST(X)                                                                          \
	X("brain", 80, 40)                                                                         \
	X("stroke", 40, 40)                                                                        \
	X("temporal", 2800, 600)                                                                   \
	X("lung", 1500, -600)                                                                      \
	X("mediastinum", 350, 50)                                                                  \
	X("soft", 400, 50)                                                                         \
	X("liver", 150, 30)                                                                        \
	X("spine", 250, 50)                                                                        \
	X("bone", 1800, 400)
#define HU_WINDOW_SPACE(name, width, level) " " name

/* "LO:HI" of any unit, or a name, which sets *hu. CT_EUSAGE naming the option. */
int hu_window_parse(
	double window[2], bool *hu, const char *option, const char *text, struct ct_err *e);

#endif
