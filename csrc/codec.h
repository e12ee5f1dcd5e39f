/* Numbers of a PDO: little-endian bytes of the types of CiA 301 that it may map. Both ends of the wire use
 * it. */
#ifndef HAPTICD_CODEC_H
#define HAPTICD_CODEC_H

#include <stdint.h>

typedef enum { CODEC_U8, CODEC_I8, CODEC_U16, CODEC_I16, CODEC_U32, CODEC_I32, CODEC_F32 } codec_type;

/* The number at a place. */
double codec_number(const uint8_t *at, uint8_t type);

/* Its bits, as a whole number of at least zero. */
uint32_t codec_word(const uint8_t *at, uint8_t type);

/* Writes a number, rounded halves to even where its type is whole, and cut to what the type holds; a whole
   type cuts a NaN to its lowest number, a float keeps what is not finite. Returns 1 where a number was cut.
 */
int codec_put_number(uint8_t *at, uint8_t type, double number);

/* Writes bits; those that the type does not have are left out. */
void codec_put_word(uint8_t *at, uint8_t type, uint32_t word);

/* An unsigned number of two bytes. */
uint16_t codec_u16(const uint8_t *at);

#endif
