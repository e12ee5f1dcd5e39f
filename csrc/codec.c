#include "codec.h"

#include <math.h>
#include <string.h>

static const struct {
    double low, high;
    size_t size;
} RANGE[] = {
    [CODEC_U8] = {0.0, 255.0, 1},
    [CODEC_I8] = {-128.0, 127.0, 1},
    [CODEC_U16] = {0.0, 65535.0, 2},
    [CODEC_I16] = {-32768.0, 32767.0, 2},
    [CODEC_U32] = {0.0, 4294967295.0, 4},
    [CODEC_I32] = {-2147483648.0, 2147483647.0, 4},
    [CODEC_F32] = {-3.4028234663852886e38, 3.4028234663852886e38, 4},
};

uint16_t codec_u16(const uint8_t *at) {
    return (uint16_t)(at[0] | at[1] << 8);
}

static uint32_t read_u32(const uint8_t *at) {
    uint32_t raw;
    memcpy(&raw, at, 4);
    return raw;
}

double codec_number(const uint8_t *at, uint8_t type) {
    float single;
    switch ((codec_type)type) {
    case CODEC_U8:
        return at[0];
    case CODEC_I8:
        return (int8_t)at[0];
    case CODEC_U16:
        return codec_u16(at);
    case CODEC_I16:
        return (int16_t)codec_u16(at);
    case CODEC_U32:
        return read_u32(at);
    case CODEC_I32:
        return (int32_t)read_u32(at);
    case CODEC_F32:
        memcpy(&single, at, 4);
        return (double)single;
    }
    return NAN;
}

uint32_t codec_word(const uint8_t *at, uint8_t type) {
    switch ((codec_type)type) {
    case CODEC_U8:
    case CODEC_I8:
        return at[0];
    case CODEC_U16:
    case CODEC_I16:
        return codec_u16(at);
    case CODEC_U32:
    case CODEC_I32:
    case CODEC_F32:
        break;
    }
    return read_u32(at);
}

int codec_put_number(uint8_t *at, uint8_t type, double number) {
    if (type == CODEC_F32) {
        const double cut = isfinite(number) ? fmin(fmax(number, RANGE[type].low), RANGE[type].high) : number;
        const float single = (float)cut;
        memcpy(at, &single, 4);
        return isfinite(number) && cut != number;
    }
    const double cut = fmin(fmax(rint(number), RANGE[type].low), RANGE[type].high);
    const int64_t whole = (int64_t)cut;
    memcpy(at, &whole, RANGE[type].size);
    return fabs(cut - number) > 0.5;
}

void codec_put_word(uint8_t *at, uint8_t type, uint32_t word) {
    memcpy(at, &word, RANGE[type].size);
}
