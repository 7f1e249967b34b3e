/* text.h: our strings in JSON. */
#ifndef CT_FORMATS_TEXT_H
#define CT_FORMATS_TEXT_H
#include <jansson.h>

/* A JSON string of s. JSON is UTF-8; a history may name files that are not: then every byte
 * beyond ASCII becomes '?'. NULL: no memory. */
json_t *ct_text_json(const char *s);

#endif
