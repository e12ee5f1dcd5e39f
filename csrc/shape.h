/* What a field that points to an array says of it, to whoever binds one; nothing to the compiler.
 *
 *     const double *J SHAPE(6, n);    row-major; `const`: only read
 *     const double *rate OPTIONAL(n); or NULL
 *     const uint8_t *fresh STRIDED(any, stride); entries so many bytes apart
 *
 * Sizes are numbers, other fields of the struct, names that the caller gives a size, or `any`. csrc/build.py
 * reads them, binding/bind.py checks arrays against them. */
#ifndef HAPTICD_SHAPE_H
#define HAPTICD_SHAPE_H

#define SHAPE(...)
#define OPTIONAL(...)
#define STRIDED(...)

#endif
