/* order.h: functions for qsort(3), ascending. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_CORE_ORDER_H
#define CT_CORE_ORDER_H

#define CT_ORDER_OF(a, b) (((a) > (b)) - ((a) < (b)))

/* A static function of this name, of values. */
#define CT_ORDER(name, type)                                                                       \
	static int name(const void *p, const void *q)                                              \
	{                                                                                          \
		return CT_ORDER_OF(*(const type *)p, *(const type *)q);                            \
	}

/* Of structs, by a member and then by another. */
#define CT_ORDER_BY(name, type, first, then)                                                       \
	static int name(const void *p, const void *q)                                              \
	{                                                                                          \
		const type *a = p, *b = q;                                                         \
		const int c = CT_ORDER_OF(a->first, b->first);                                     \
                                                                                                   \
		return c ? c : CT_ORDER_OF(a->then, b->then);                                      \
	}

#endif
