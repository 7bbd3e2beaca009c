/*
 * Wire format of relpos nodes and cars, version 1: see docs/reference/wire-format.md.
 *
 * Made from the definition by `python -m hardware_bridge.wire.c_header`; do not edit.
 * C99, one file, no memory but the caller's, nothing of the C library but types.
 *
 *     sending     relpos_frame f = {0};
 *                 f.type = RELPOS_IMU; f.node = 3; f.boot = boot; f.sequence = sequence++;
 *                 f.time = micros();
 *                 relpos_imu_set_gyr(&f.of.imu, 0, rate_x);
 *                 n = relpos_encode(&f, key, bytes);
 *     receiving   if (relpos_receive(&receiver, byte, key, &f) == RELPOS_OK) switch (f.type) ...
 *
 * A receiver that acts on frames also checks, per sender, that boot and sequence rise.
 */
#ifndef RELPOS_WIRE_H
#define RELPOS_WIRE_H

#include <stddef.h>
#include <stdint.h>

#define RELPOS_VERSION 1u
#define RELPOS_HOST 65535u /* node of the host that commands the cars */
#define RELPOS_MOST_ROWS 32u
#define RELPOS_MOST_FRAME 512u
#define RELPOS_MOST_CODED (RELPOS_MOST_FRAME + 3u) /* stuffed */
#define RELPOS_MOST_BYTES (RELPOS_MOST_CODED + 2u) /* between two zeros */
#define RELPOS_HEADER_BYTES 16u
#define RELPOS_KEY_BYTES 16u
#define RELPOS_MAC_BYTES 8u
#define RELPOS_CRC_BYTES 4u
#define RELPOS_FLAG_MAC 1u

/* What a receiver says. */
enum {
    RELPOS_NOTHING = 0, /* no frame ends here */
    RELPOS_OK = 1,
    RELPOS_SKIPPED = 2, /* whole, but of another version, or a message that is not known */
    RELPOS_DAMAGED = 3, /* check sum, MAC or length */
    RELPOS_STRANGE = 4  /* too long for a frame */
};

/* a sample of an inertial sensor */
#define RELPOS_IMU 1u
typedef struct {
    int32_t gyr[3]; /* [1/100000 rad/s] turn rate in the body frame: x forward, y left, z up */
    int32_t acc[3]; /* [1/10000 m/s2] specific force in the body frame, +9.8 on z at rest */
} relpos_imu;

/* the same with the magnetometer */
#define RELPOS_IMU_MAG 2u
typedef struct {
    int32_t gyr[3]; /* [1/100000 rad/s] turn rate in the body frame: x forward, y left, z up */
    int32_t acc[3]; /* [1/10000 m/s2] specific force in the body frame, +9.8 on z at rest */
    int32_t mag[3]; /* [1/1000 uT] magnetic field in the body frame */
} relpos_imu_mag;

/* of a node that filters its orientation itself */
#define RELPOS_STATE 3u
typedef struct {
    int32_t q[4]; /* [1/8000000] unit quaternion w x y z, body to world */
    int32_t acc[3]; /* [1/10000 m/s2] acceleration in the world frame, without gravity */
} relpos_state;

/* distances that were measured at one time */
#define RELPOS_RANGES 4u
#define RELPOS_RANGES_HAS_NEARER 1u
#define RELPOS_RANGES_HAS_RX_POWER 2u
#define RELPOS_RANGES_HAS_FP_POWER 4u
#define RELPOS_RANGES_HAS_QUALITY 8u
typedef struct {
    uint16_t to; /* the other node */
    uint16_t nearer; /* the near end, where that is not the sender */
    int32_t distance; /* [1/10000 m] between the antennas */
    int16_t rx_power; /* [1/100 dBm] received power */
    int16_t fp_power; /* [1/100 dBm] that of the first path */
    uint8_t quality; /* [1/255] how sure the radio is of a line of sight, 0 to 1 */
    uint8_t has; /* which of these are there; the others are 0 */
} relpos_ranges_row;
typedef struct {
    uint8_t n;
    relpos_ranges_row row[RELPOS_MOST_ROWS];
} relpos_ranges;

/* what a car says of its own motion */
#define RELPOS_MOTION 5u
#define RELPOS_MOTION_HAS_STEERING 1u
typedef struct {
    int16_t speed; /* [1/1000 m/s] forward, by wheels or motor */
    int16_t steering; /* [1/10000 rad] of the front wheels, left is positive */
    uint8_t has; /* whether that is there */
} relpos_motion;

/* how a device does */
#define RELPOS_STATUS 6u
#define RELPOS_STATUS_HAS_VOLTAGE 1u
typedef struct {
    uint32_t fault; /* 0 is none; else what the firmware says */
    uint16_t voltage; /* [1/1000 V] of the battery */
    uint8_t has; /* whether that is there */
} relpos_status;

/* a device is alive */
#define RELPOS_HEARTBEAT 7u

/* what distance sensors on a car measured at one time */
#define RELPOS_NEAR 8u
#define RELPOS_NEAR_HAS_DISTANCE 1u
typedef struct {
    int16_t bearing; /* [1/10000 rad] in which direction from the car's middle, 0 ahead, left is positive */
    uint16_t distance; /* [1/1000 m] from the car's body to what is nearest there */
    uint8_t has; /* 0 where the sensor sees nothing */
} relpos_near_row;
typedef struct {
    uint8_t n;
    relpos_near_row row[RELPOS_MOST_ROWS];
} relpos_near;

/* motion of another node, from its ranging messages; see `tracking.ranging` */
#define RELPOS_PEER 9u
typedef struct {
    uint16_t of; /* the other node */
    uint16_t age; /* [1/10000 s] of the motion, before the time of the frame */
    int32_t q[4]; /* [1/8000000] unit quaternion w x y z, body to world */
    int32_t acc[3]; /* [1/10000 m/s2] mean acceleration in the world frame, without gravity */
    uint16_t noise; /* [1/1000 m/s2/sqrt(Hz)] density that adds to that of its accelerometer */
} relpos_peer;

/* what a car is to do */
#define RELPOS_COMMAND 16u
#define RELPOS_COMMAND_FLAGS_BRAKE 1u
typedef struct {
    uint16_t to; /* node of the car that is meant */
    int16_t speed; /* [1/1000 m/s] forward */
    int16_t steering; /* [1/10000 rad] left is positive */
    uint8_t flags; /* brake: stop, whatever the other fields say */
} relpos_command;

/* a person with a remote control asks a car for a velocity */
#define RELPOS_REMOTE 17u
typedef struct {
    uint16_t to; /* node of the car that is meant */
    int16_t velocity[2]; /* [1/1000 m/s] in the world frame, x and y */
} relpos_remote;

/* a command was taken */
#define RELPOS_ACK 18u
typedef struct {
    uint32_t command; /* sequence number of that command */
} relpos_ack;


typedef struct {
    uint8_t type;
    uint8_t mac; /* of a frame that was received: it carried one */
    uint16_t node;
    uint32_t boot;
    uint32_t sequence;
    uint32_t time; /* [us] */
    union {
        relpos_imu imu;
        relpos_imu_mag imu_mag;
        relpos_state state;
        relpos_ranges ranges;
        relpos_motion motion;
        relpos_status status;
        relpos_near near;
        relpos_peer peer;
        relpos_command command;
        relpos_remote remote;
        relpos_ack ack;
    } of;
} relpos_frame;

/* ---- numbers ---- */

static inline void relpos_put(uint8_t *out, uint32_t value, size_t n) {
    for (size_t k = 0; k < n; k++) out[k] = (uint8_t)(value >> (8 * k));
}

static inline uint32_t relpos_get(const uint8_t *in, size_t n) {
    uint32_t value = 0;
    for (size_t k = 0; k < n; k++) value |= (uint32_t)in[k] << (8 * k);
    return value;
}

/* The same of two's complement. */
static inline int32_t relpos_get_signed(const uint8_t *in, size_t n) {
    uint32_t sign = (uint32_t)1 << (8 * n - 1);
    uint32_t value = relpos_get(in, n);
    if (!(value & sign)) return (int32_t)value;
    return -(int32_t)(sign - 1 - (value & (sign - 1))) - 1;
}

/* A value as a number of steps, the nearest that fits; 0 if the value is not finite. */
static inline int relpos_scale(float value, float steps, int32_t low, int32_t high, int32_t *out) {
    float x = value * steps;
    if (!(value - value == 0.0f)) return 0;
    if (x >= (float)high)
        *out = high;
    else if (x <= (float)low)
        *out = low;
    else
        *out = x >= 0.0f ? (int32_t)(x + 0.5f) : -(int32_t)(0.5f - x);
    return 1;
}

/* ---- check sums ---- */

/* CRC-32 of Ethernet and zlib, four bits at a time. */
static inline uint32_t relpos_crc32(const uint8_t *data, size_t n) {
    static const uint32_t table[16] = {
        0x00000000u, 0x1db71064u, 0x3b6e20c8u, 0x26d930acu,
        0x76dc4190u, 0x6b6b51f4u, 0x4db26158u, 0x5005713cu,
        0xedb88320u, 0xf00f9344u, 0xd6d6a3e8u, 0xcb61b38cu,
        0x9b64c2b0u, 0x86d3d2d4u, 0xa00ae278u, 0xbdbdf21cu,
    };
    uint32_t crc = 0xFFFFFFFFu;
    for (size_t k = 0; k < n; k++) {
        crc ^= data[k];
        crc = crc >> 4 ^ table[crc & 15u];
        crc = crc >> 4 ^ table[crc & 15u];
    }
    return ~crc;
}

static inline uint64_t relpos_turn(uint64_t x, unsigned bits) {
    return x << bits | x >> (64u - bits);
}

static inline void relpos_sip_round(uint64_t v[4]) {
    v[0] += v[1];
    v[2] += v[3];
    v[1] = relpos_turn(v[1], 13) ^ v[0];
    v[3] = relpos_turn(v[3], 16) ^ v[2];
    v[0] = relpos_turn(v[0], 32);
    v[2] += v[1];
    v[0] += v[3];
    v[1] = relpos_turn(v[1], 17) ^ v[2];
    v[3] = relpos_turn(v[3], 21) ^ v[0];
    v[2] = relpos_turn(v[2], 32);
}

static inline uint64_t relpos_word(const uint8_t *in, size_t n) {
    uint64_t value = 0;
    for (size_t k = 0; k < n; k++) value |= (uint64_t)in[k] << (8 * k);
    return value;
}

/* SipHash-2-4, Aumasson and Bernstein, INDOCRYPT 2012. */
static inline uint64_t relpos_siphash(const uint8_t *data, size_t n, const uint8_t *key) {
    uint64_t k0 = relpos_word(key, 8), k1 = relpos_word(key + 8, 8);
    uint64_t v[4] = {k0 ^ 0x736f6d6570736575u, k1 ^ 0x646f72616e646f6du,
                     k0 ^ 0x6c7967656e657261u, k1 ^ 0x7465646279746573u};
    for (size_t at = 0; at <= n; at += 8) {
        size_t left = n - at < 8 ? n - at : 8;
        uint64_t word = relpos_word(data + at, left);
        if (left < 8) word |= (uint64_t)(n & 0xFFu) << 56;
        v[3] ^= word;
        relpos_sip_round(v);
        relpos_sip_round(v);
        v[0] ^= word;
    }
    v[2] ^= 0xFFu;
    for (int k = 0; k < 4; k++) relpos_sip_round(v);
    return v[0] ^ v[1] ^ v[2] ^ v[3];
}

/* ---- framing: consistent overhead byte stuffing ---- */

/* Stuff n bytes from `raw` and add the zero; returns how many are written. `out` may overlap
   `raw` if it begins three bytes before. */
static inline size_t relpos_stuff(const uint8_t *raw, size_t n, uint8_t *out) {
    size_t mark = 0, at = 1;
    for (size_t k = 0; k < n; k++) {
        uint8_t byte = raw[k];
        if (byte) out[at++] = byte;
        if (!byte || (at - mark == 255 && k + 1 < n)) {
            out[mark] = (uint8_t)(at - mark);
            mark = at++;
        }
    }
    out[mark] = (uint8_t)(at - mark);
    out[at++] = 0;
    return at;
}

/* Undo it in place, without the zero; returns how many bytes are left, 0 if it is no frame. */
static inline size_t relpos_unstuff(uint8_t *bytes, size_t n) {
    size_t at = 0, out = 0;
    while (at < n) {
        size_t code = bytes[at];
        if (code == 0 || at + code > n) return 0;
        for (size_t k = 1; k < code; k++) bytes[out++] = bytes[at + k];
        at += code;
        if (code < 255 && at < n) bytes[out++] = 0;
    }
    return out;
}

/* ---- messages ---- */

#define RELPOS_IMU_BYTES 18u
static inline void relpos_imu_put(const relpos_imu *m, uint8_t *out) {
    relpos_put(out + 0, (uint32_t)m->gyr[0], 3);
    relpos_put(out + 3, (uint32_t)m->gyr[1], 3);
    relpos_put(out + 6, (uint32_t)m->gyr[2], 3);
    relpos_put(out + 9, (uint32_t)m->acc[0], 3);
    relpos_put(out + 12, (uint32_t)m->acc[1], 3);
    relpos_put(out + 15, (uint32_t)m->acc[2], 3);
}
static inline void relpos_imu_get(relpos_imu *m, const uint8_t *in) {
    m->gyr[0] = (int32_t)relpos_get_signed(in + 0, 3);
    m->gyr[1] = (int32_t)relpos_get_signed(in + 3, 3);
    m->gyr[2] = (int32_t)relpos_get_signed(in + 6, 3);
    m->acc[0] = (int32_t)relpos_get_signed(in + 9, 3);
    m->acc[1] = (int32_t)relpos_get_signed(in + 12, 3);
    m->acc[2] = (int32_t)relpos_get_signed(in + 15, 3);
}
/* [rad/s]; 0 and nothing is set if the value is not finite. */
static inline int relpos_imu_set_gyr(relpos_imu *m, size_t k, float value) {
    int32_t number;
    if (!relpos_scale(value, 100000.0f, -8388607 - 1, 8388607, &number)) return 0;
    m->gyr[k] = (int32_t)number;
    return 1;
}
static inline float relpos_imu_gyr(const relpos_imu *m, size_t k) {
    return (float)m->gyr[k] / 100000.0f;
}
/* [m/s2]; 0 and nothing is set if the value is not finite. */
static inline int relpos_imu_set_acc(relpos_imu *m, size_t k, float value) {
    int32_t number;
    if (!relpos_scale(value, 10000.0f, -8388607 - 1, 8388607, &number)) return 0;
    m->acc[k] = (int32_t)number;
    return 1;
}
static inline float relpos_imu_acc(const relpos_imu *m, size_t k) {
    return (float)m->acc[k] / 10000.0f;
}

#define RELPOS_IMU_MAG_BYTES 27u
static inline void relpos_imu_mag_put(const relpos_imu_mag *m, uint8_t *out) {
    relpos_put(out + 0, (uint32_t)m->gyr[0], 3);
    relpos_put(out + 3, (uint32_t)m->gyr[1], 3);
    relpos_put(out + 6, (uint32_t)m->gyr[2], 3);
    relpos_put(out + 9, (uint32_t)m->acc[0], 3);
    relpos_put(out + 12, (uint32_t)m->acc[1], 3);
    relpos_put(out + 15, (uint32_t)m->acc[2], 3);
    relpos_put(out + 18, (uint32_t)m->mag[0], 3);
    relpos_put(out + 21, (uint32_t)m->mag[1], 3);
    relpos_put(out + 24, (uint32_t)m->mag[2], 3);
}
static inline void relpos_imu_mag_get(relpos_imu_mag *m, const uint8_t *in) {
    m->gyr[0] = (int32_t)relpos_get_signed(in + 0, 3);
    m->gyr[1] = (int32_t)relpos_get_signed(in + 3, 3);
    m->gyr[2] = (int32_t)relpos_get_signed(in + 6, 3);
    m->acc[0] = (int32_t)relpos_get_signed(in + 9, 3);
    m->acc[1] = (int32_t)relpos_get_signed(in + 12, 3);
    m->acc[2] = (int32_t)relpos_get_signed(in + 15, 3);
    m->mag[0] = (int32_t)relpos_get_signed(in + 18, 3);
    m->mag[1] = (int32_t)relpos_get_signed(in + 21, 3);
    m->mag[2] = (int32_t)relpos_get_signed(in + 24, 3);
}
/* [rad/s]; 0 and nothing is set if the value is not finite. */
static inline int relpos_imu_mag_set_gyr(relpos_imu_mag *m, size_t k, float value) {
    int32_t number;
    if (!relpos_scale(value, 100000.0f, -8388607 - 1, 8388607, &number)) return 0;
    m->gyr[k] = (int32_t)number;
    return 1;
}
static inline float relpos_imu_mag_gyr(const relpos_imu_mag *m, size_t k) {
    return (float)m->gyr[k] / 100000.0f;
}
/* [m/s2]; 0 and nothing is set if the value is not finite. */
static inline int relpos_imu_mag_set_acc(relpos_imu_mag *m, size_t k, float value) {
    int32_t number;
    if (!relpos_scale(value, 10000.0f, -8388607 - 1, 8388607, &number)) return 0;
    m->acc[k] = (int32_t)number;
    return 1;
}
static inline float relpos_imu_mag_acc(const relpos_imu_mag *m, size_t k) {
    return (float)m->acc[k] / 10000.0f;
}
/* [uT]; 0 and nothing is set if the value is not finite. */
static inline int relpos_imu_mag_set_mag(relpos_imu_mag *m, size_t k, float value) {
    int32_t number;
    if (!relpos_scale(value, 1000.0f, -8388607 - 1, 8388607, &number)) return 0;
    m->mag[k] = (int32_t)number;
    return 1;
}
static inline float relpos_imu_mag_mag(const relpos_imu_mag *m, size_t k) {
    return (float)m->mag[k] / 1000.0f;
}

#define RELPOS_STATE_BYTES 21u
static inline void relpos_state_put(const relpos_state *m, uint8_t *out) {
    relpos_put(out + 0, (uint32_t)m->q[0], 3);
    relpos_put(out + 3, (uint32_t)m->q[1], 3);
    relpos_put(out + 6, (uint32_t)m->q[2], 3);
    relpos_put(out + 9, (uint32_t)m->q[3], 3);
    relpos_put(out + 12, (uint32_t)m->acc[0], 3);
    relpos_put(out + 15, (uint32_t)m->acc[1], 3);
    relpos_put(out + 18, (uint32_t)m->acc[2], 3);
}
static inline void relpos_state_get(relpos_state *m, const uint8_t *in) {
    m->q[0] = (int32_t)relpos_get_signed(in + 0, 3);
    m->q[1] = (int32_t)relpos_get_signed(in + 3, 3);
    m->q[2] = (int32_t)relpos_get_signed(in + 6, 3);
    m->q[3] = (int32_t)relpos_get_signed(in + 9, 3);
    m->acc[0] = (int32_t)relpos_get_signed(in + 12, 3);
    m->acc[1] = (int32_t)relpos_get_signed(in + 15, 3);
    m->acc[2] = (int32_t)relpos_get_signed(in + 18, 3);
}
/* [-]; 0 and nothing is set if the value is not finite. */
static inline int relpos_state_set_q(relpos_state *m, size_t k, float value) {
    int32_t number;
    if (!relpos_scale(value, 8000000.0f, -8388607 - 1, 8388607, &number)) return 0;
    m->q[k] = (int32_t)number;
    return 1;
}
static inline float relpos_state_q(const relpos_state *m, size_t k) {
    return (float)m->q[k] / 8000000.0f;
}
/* [m/s2]; 0 and nothing is set if the value is not finite. */
static inline int relpos_state_set_acc(relpos_state *m, size_t k, float value) {
    int32_t number;
    if (!relpos_scale(value, 10000.0f, -8388607 - 1, 8388607, &number)) return 0;
    m->acc[k] = (int32_t)number;
    return 1;
}
static inline float relpos_state_acc(const relpos_state *m, size_t k) {
    return (float)m->acc[k] / 10000.0f;
}

#define RELPOS_RANGES_ROW_BYTES 14u
static inline void relpos_ranges_row_put(const relpos_ranges_row *m, uint8_t *out) {
    relpos_put(out + 0, (uint32_t)m->to, 2);
    relpos_put(out + 2, (uint32_t)m->nearer, 2);
    relpos_put(out + 4, (uint32_t)m->distance, 4);
    relpos_put(out + 8, (uint32_t)m->rx_power, 2);
    relpos_put(out + 10, (uint32_t)m->fp_power, 2);
    relpos_put(out + 12, (uint32_t)m->quality, 1);
    relpos_put(out + 13, (uint32_t)m->has, 1);
}
static inline void relpos_ranges_row_get(relpos_ranges_row *m, const uint8_t *in) {
    m->to = (uint16_t)relpos_get(in + 0, 2);
    m->nearer = (uint16_t)relpos_get(in + 2, 2);
    m->distance = (int32_t)relpos_get_signed(in + 4, 4);
    m->rx_power = (int16_t)relpos_get_signed(in + 8, 2);
    m->fp_power = (int16_t)relpos_get_signed(in + 10, 2);
    m->quality = (uint8_t)relpos_get(in + 12, 1);
    m->has = (uint8_t)relpos_get(in + 13, 1);
}
/* [m]; 0 and nothing is set if the value is not finite. */
static inline int relpos_ranges_row_set_distance(relpos_ranges_row *m, float value) {
    int32_t number;
    if (!relpos_scale(value, 10000.0f, -2147483647 - 1, 2147483647, &number)) return 0;
    m->distance = (int32_t)number;
    return 1;
}
static inline float relpos_ranges_row_distance(const relpos_ranges_row *m) {
    return (float)m->distance / 10000.0f;
}
/* [dBm]; 0 and nothing is set if the value is not finite. */
static inline int relpos_ranges_row_set_rx_power(relpos_ranges_row *m, float value) {
    int32_t number;
    if (!relpos_scale(value, 100.0f, -32767 - 1, 32767, &number)) return 0;
    m->rx_power = (int16_t)number;
    return 1;
}
static inline float relpos_ranges_row_rx_power(const relpos_ranges_row *m) {
    return (float)m->rx_power / 100.0f;
}
/* [dBm]; 0 and nothing is set if the value is not finite. */
static inline int relpos_ranges_row_set_fp_power(relpos_ranges_row *m, float value) {
    int32_t number;
    if (!relpos_scale(value, 100.0f, -32767 - 1, 32767, &number)) return 0;
    m->fp_power = (int16_t)number;
    return 1;
}
static inline float relpos_ranges_row_fp_power(const relpos_ranges_row *m) {
    return (float)m->fp_power / 100.0f;
}
/* [-]; 0 and nothing is set if the value is not finite. */
static inline int relpos_ranges_row_set_quality(relpos_ranges_row *m, float value) {
    int32_t number;
    if (!relpos_scale(value, 255.0f, 0, 255, &number)) return 0;
    m->quality = (uint8_t)number;
    return 1;
}
static inline float relpos_ranges_row_quality(const relpos_ranges_row *m) {
    return (float)m->quality / 255.0f;
}

#define RELPOS_MOTION_BYTES 5u
static inline void relpos_motion_put(const relpos_motion *m, uint8_t *out) {
    relpos_put(out + 0, (uint32_t)m->speed, 2);
    relpos_put(out + 2, (uint32_t)m->steering, 2);
    relpos_put(out + 4, (uint32_t)m->has, 1);
}
static inline void relpos_motion_get(relpos_motion *m, const uint8_t *in) {
    m->speed = (int16_t)relpos_get_signed(in + 0, 2);
    m->steering = (int16_t)relpos_get_signed(in + 2, 2);
    m->has = (uint8_t)relpos_get(in + 4, 1);
}
/* [m/s]; 0 and nothing is set if the value is not finite. */
static inline int relpos_motion_set_speed(relpos_motion *m, float value) {
    int32_t number;
    if (!relpos_scale(value, 1000.0f, -32767 - 1, 32767, &number)) return 0;
    m->speed = (int16_t)number;
    return 1;
}
static inline float relpos_motion_speed(const relpos_motion *m) {
    return (float)m->speed / 1000.0f;
}
/* [rad]; 0 and nothing is set if the value is not finite. */
static inline int relpos_motion_set_steering(relpos_motion *m, float value) {
    int32_t number;
    if (!relpos_scale(value, 10000.0f, -32767 - 1, 32767, &number)) return 0;
    m->steering = (int16_t)number;
    return 1;
}
static inline float relpos_motion_steering(const relpos_motion *m) {
    return (float)m->steering / 10000.0f;
}

#define RELPOS_STATUS_BYTES 7u
static inline void relpos_status_put(const relpos_status *m, uint8_t *out) {
    relpos_put(out + 0, (uint32_t)m->fault, 4);
    relpos_put(out + 4, (uint32_t)m->voltage, 2);
    relpos_put(out + 6, (uint32_t)m->has, 1);
}
static inline void relpos_status_get(relpos_status *m, const uint8_t *in) {
    m->fault = (uint32_t)relpos_get(in + 0, 4);
    m->voltage = (uint16_t)relpos_get(in + 4, 2);
    m->has = (uint8_t)relpos_get(in + 6, 1);
}
/* [V]; 0 and nothing is set if the value is not finite. */
static inline int relpos_status_set_voltage(relpos_status *m, float value) {
    int32_t number;
    if (!relpos_scale(value, 1000.0f, 0, 65535, &number)) return 0;
    m->voltage = (uint16_t)number;
    return 1;
}
static inline float relpos_status_voltage(const relpos_status *m) {
    return (float)m->voltage / 1000.0f;
}

#define RELPOS_NEAR_ROW_BYTES 5u
static inline void relpos_near_row_put(const relpos_near_row *m, uint8_t *out) {
    relpos_put(out + 0, (uint32_t)m->bearing, 2);
    relpos_put(out + 2, (uint32_t)m->distance, 2);
    relpos_put(out + 4, (uint32_t)m->has, 1);
}
static inline void relpos_near_row_get(relpos_near_row *m, const uint8_t *in) {
    m->bearing = (int16_t)relpos_get_signed(in + 0, 2);
    m->distance = (uint16_t)relpos_get(in + 2, 2);
    m->has = (uint8_t)relpos_get(in + 4, 1);
}
/* [rad]; 0 and nothing is set if the value is not finite. */
static inline int relpos_near_row_set_bearing(relpos_near_row *m, float value) {
    int32_t number;
    if (!relpos_scale(value, 10000.0f, -32767 - 1, 32767, &number)) return 0;
    m->bearing = (int16_t)number;
    return 1;
}
static inline float relpos_near_row_bearing(const relpos_near_row *m) {
    return (float)m->bearing / 10000.0f;
}
/* [m]; 0 and nothing is set if the value is not finite. */
static inline int relpos_near_row_set_distance(relpos_near_row *m, float value) {
    int32_t number;
    if (!relpos_scale(value, 1000.0f, 0, 65535, &number)) return 0;
    m->distance = (uint16_t)number;
    return 1;
}
static inline float relpos_near_row_distance(const relpos_near_row *m) {
    return (float)m->distance / 1000.0f;
}

#define RELPOS_PEER_BYTES 27u
static inline void relpos_peer_put(const relpos_peer *m, uint8_t *out) {
    relpos_put(out + 0, (uint32_t)m->of, 2);
    relpos_put(out + 2, (uint32_t)m->age, 2);
    relpos_put(out + 4, (uint32_t)m->q[0], 3);
    relpos_put(out + 7, (uint32_t)m->q[1], 3);
    relpos_put(out + 10, (uint32_t)m->q[2], 3);
    relpos_put(out + 13, (uint32_t)m->q[3], 3);
    relpos_put(out + 16, (uint32_t)m->acc[0], 3);
    relpos_put(out + 19, (uint32_t)m->acc[1], 3);
    relpos_put(out + 22, (uint32_t)m->acc[2], 3);
    relpos_put(out + 25, (uint32_t)m->noise, 2);
}
static inline void relpos_peer_get(relpos_peer *m, const uint8_t *in) {
    m->of = (uint16_t)relpos_get(in + 0, 2);
    m->age = (uint16_t)relpos_get(in + 2, 2);
    m->q[0] = (int32_t)relpos_get_signed(in + 4, 3);
    m->q[1] = (int32_t)relpos_get_signed(in + 7, 3);
    m->q[2] = (int32_t)relpos_get_signed(in + 10, 3);
    m->q[3] = (int32_t)relpos_get_signed(in + 13, 3);
    m->acc[0] = (int32_t)relpos_get_signed(in + 16, 3);
    m->acc[1] = (int32_t)relpos_get_signed(in + 19, 3);
    m->acc[2] = (int32_t)relpos_get_signed(in + 22, 3);
    m->noise = (uint16_t)relpos_get(in + 25, 2);
}
/* [s]; 0 and nothing is set if the value is not finite. */
static inline int relpos_peer_set_age(relpos_peer *m, float value) {
    int32_t number;
    if (!relpos_scale(value, 10000.0f, 0, 65535, &number)) return 0;
    m->age = (uint16_t)number;
    return 1;
}
static inline float relpos_peer_age(const relpos_peer *m) {
    return (float)m->age / 10000.0f;
}
/* [-]; 0 and nothing is set if the value is not finite. */
static inline int relpos_peer_set_q(relpos_peer *m, size_t k, float value) {
    int32_t number;
    if (!relpos_scale(value, 8000000.0f, -8388607 - 1, 8388607, &number)) return 0;
    m->q[k] = (int32_t)number;
    return 1;
}
static inline float relpos_peer_q(const relpos_peer *m, size_t k) {
    return (float)m->q[k] / 8000000.0f;
}
/* [m/s2]; 0 and nothing is set if the value is not finite. */
static inline int relpos_peer_set_acc(relpos_peer *m, size_t k, float value) {
    int32_t number;
    if (!relpos_scale(value, 10000.0f, -8388607 - 1, 8388607, &number)) return 0;
    m->acc[k] = (int32_t)number;
    return 1;
}
static inline float relpos_peer_acc(const relpos_peer *m, size_t k) {
    return (float)m->acc[k] / 10000.0f;
}
/* [m/s2/sqrt(Hz)]; 0 and nothing is set if the value is not finite. */
static inline int relpos_peer_set_noise(relpos_peer *m, float value) {
    int32_t number;
    if (!relpos_scale(value, 1000.0f, 0, 65535, &number)) return 0;
    m->noise = (uint16_t)number;
    return 1;
}
static inline float relpos_peer_noise(const relpos_peer *m) {
    return (float)m->noise / 1000.0f;
}

#define RELPOS_COMMAND_BYTES 7u
static inline void relpos_command_put(const relpos_command *m, uint8_t *out) {
    relpos_put(out + 0, (uint32_t)m->to, 2);
    relpos_put(out + 2, (uint32_t)m->speed, 2);
    relpos_put(out + 4, (uint32_t)m->steering, 2);
    relpos_put(out + 6, (uint32_t)m->flags, 1);
}
static inline void relpos_command_get(relpos_command *m, const uint8_t *in) {
    m->to = (uint16_t)relpos_get(in + 0, 2);
    m->speed = (int16_t)relpos_get_signed(in + 2, 2);
    m->steering = (int16_t)relpos_get_signed(in + 4, 2);
    m->flags = (uint8_t)relpos_get(in + 6, 1);
}
/* [m/s]; 0 and nothing is set if the value is not finite. */
static inline int relpos_command_set_speed(relpos_command *m, float value) {
    int32_t number;
    if (!relpos_scale(value, 1000.0f, -32767 - 1, 32767, &number)) return 0;
    m->speed = (int16_t)number;
    return 1;
}
static inline float relpos_command_speed(const relpos_command *m) {
    return (float)m->speed / 1000.0f;
}
/* [rad]; 0 and nothing is set if the value is not finite. */
static inline int relpos_command_set_steering(relpos_command *m, float value) {
    int32_t number;
    if (!relpos_scale(value, 10000.0f, -32767 - 1, 32767, &number)) return 0;
    m->steering = (int16_t)number;
    return 1;
}
static inline float relpos_command_steering(const relpos_command *m) {
    return (float)m->steering / 10000.0f;
}

#define RELPOS_REMOTE_BYTES 6u
static inline void relpos_remote_put(const relpos_remote *m, uint8_t *out) {
    relpos_put(out + 0, (uint32_t)m->to, 2);
    relpos_put(out + 2, (uint32_t)m->velocity[0], 2);
    relpos_put(out + 4, (uint32_t)m->velocity[1], 2);
}
static inline void relpos_remote_get(relpos_remote *m, const uint8_t *in) {
    m->to = (uint16_t)relpos_get(in + 0, 2);
    m->velocity[0] = (int16_t)relpos_get_signed(in + 2, 2);
    m->velocity[1] = (int16_t)relpos_get_signed(in + 4, 2);
}
/* [m/s]; 0 and nothing is set if the value is not finite. */
static inline int relpos_remote_set_velocity(relpos_remote *m, size_t k, float value) {
    int32_t number;
    if (!relpos_scale(value, 1000.0f, -32767 - 1, 32767, &number)) return 0;
    m->velocity[k] = (int16_t)number;
    return 1;
}
static inline float relpos_remote_velocity(const relpos_remote *m, size_t k) {
    return (float)m->velocity[k] / 1000.0f;
}

#define RELPOS_ACK_BYTES 4u
static inline void relpos_ack_put(const relpos_ack *m, uint8_t *out) {
    relpos_put(out + 0, (uint32_t)m->command, 4);
}
static inline void relpos_ack_get(relpos_ack *m, const uint8_t *in) {
    m->command = (uint32_t)relpos_get(in + 0, 4);
}


/* Payload of a frame; returns its bytes, or -1 for a type that is not known or too many rows. */
static inline int relpos_pack(const relpos_frame *f, uint8_t *out) {
    switch (f->type) {
    case RELPOS_IMU:
        relpos_imu_put(&f->of.imu, out);
        return 18;
    case RELPOS_IMU_MAG:
        relpos_imu_mag_put(&f->of.imu_mag, out);
        return 27;
    case RELPOS_STATE:
        relpos_state_put(&f->of.state, out);
        return 21;
    case RELPOS_RANGES:
        if (f->of.ranges.n > RELPOS_MOST_ROWS) return -1;
        out[0] = f->of.ranges.n;
        for (size_t k = 0; k < f->of.ranges.n; k++)
            relpos_ranges_row_put(&f->of.ranges.row[k], out + 1 + 14 * k);
        return 1 + 14 * f->of.ranges.n;
    case RELPOS_MOTION:
        relpos_motion_put(&f->of.motion, out);
        return 5;
    case RELPOS_STATUS:
        relpos_status_put(&f->of.status, out);
        return 7;
    case RELPOS_HEARTBEAT:
        return 0;
    case RELPOS_NEAR:
        if (f->of.near.n > RELPOS_MOST_ROWS) return -1;
        out[0] = f->of.near.n;
        for (size_t k = 0; k < f->of.near.n; k++)
            relpos_near_row_put(&f->of.near.row[k], out + 1 + 5 * k);
        return 1 + 5 * f->of.near.n;
    case RELPOS_PEER:
        relpos_peer_put(&f->of.peer, out);
        return 27;
    case RELPOS_COMMAND:
        relpos_command_put(&f->of.command, out);
        return 7;
    case RELPOS_REMOTE:
        relpos_remote_put(&f->of.remote, out);
        return 6;
    case RELPOS_ACK:
        relpos_ack_put(&f->of.ack, out);
        return 4;
    default: return -1;
    }
}

/* The other way: 1, 0 for a wrong length, -1 for a type that is not known. */
static inline int relpos_unpack(relpos_frame *f, const uint8_t *in, size_t n) {
    switch (f->type) {
    case RELPOS_IMU:
        if (n != 18) return 0;
        relpos_imu_get(&f->of.imu, in);
        return 1;
    case RELPOS_IMU_MAG:
        if (n != 27) return 0;
        relpos_imu_mag_get(&f->of.imu_mag, in);
        return 1;
    case RELPOS_STATE:
        if (n != 21) return 0;
        relpos_state_get(&f->of.state, in);
        return 1;
    case RELPOS_RANGES:
        if (n < 1 || in[0] > RELPOS_MOST_ROWS) return 0;
        if (n != 1 + 14 * (size_t)in[0]) return 0;
        f->of.ranges.n = in[0];
        for (size_t k = 0; k < f->of.ranges.n; k++)
            relpos_ranges_row_get(&f->of.ranges.row[k], in + 1 + 14 * k);
        return 1;
    case RELPOS_MOTION:
        if (n != 5) return 0;
        relpos_motion_get(&f->of.motion, in);
        return 1;
    case RELPOS_STATUS:
        if (n != 7) return 0;
        relpos_status_get(&f->of.status, in);
        return 1;
    case RELPOS_HEARTBEAT:
        return n == 0;
    case RELPOS_NEAR:
        if (n < 1 || in[0] > RELPOS_MOST_ROWS) return 0;
        if (n != 1 + 5 * (size_t)in[0]) return 0;
        f->of.near.n = in[0];
        for (size_t k = 0; k < f->of.near.n; k++)
            relpos_near_row_get(&f->of.near.row[k], in + 1 + 5 * k);
        return 1;
    case RELPOS_PEER:
        if (n != 27) return 0;
        relpos_peer_get(&f->of.peer, in);
        return 1;
    case RELPOS_COMMAND:
        if (n != 7) return 0;
        relpos_command_get(&f->of.command, in);
        return 1;
    case RELPOS_REMOTE:
        if (n != 6) return 0;
        relpos_remote_get(&f->of.remote, in);
        return 1;
    case RELPOS_ACK:
        if (n != 4) return 0;
        relpos_ack_get(&f->of.ack, in);
        return 1;
    default: return -1;
    }
}

/* ---- frames ---- */

/* The bytes of a frame between two zeros, at most RELPOS_MOST_BYTES; returns how many, 0 if the
   frame cannot be said. With a key, 16 bytes, it carries a MAC; `key` may be NULL. */
static inline size_t relpos_encode(const relpos_frame *f, const uint8_t *key, uint8_t *out) {
    uint8_t *raw = out + 4;
    size_t n = RELPOS_HEADER_BYTES;
    int payload;
    raw[0] = (uint8_t)(RELPOS_VERSION << 4 | (key ? RELPOS_FLAG_MAC : 0u));
    raw[1] = f->type;
    relpos_put(raw + 2, f->node, 2);
    relpos_put(raw + 4, f->boot, 4);
    relpos_put(raw + 8, f->sequence, 4);
    relpos_put(raw + 12, f->time, 4);
    payload = relpos_pack(f, raw + n);
    if (payload < 0) return 0;
    n += (size_t)payload;
    if (key) {
        uint64_t mac = relpos_siphash(raw, n, key);
        relpos_put(raw + n, (uint32_t)mac, 4);
        relpos_put(raw + n + 4, (uint32_t)(mac >> 32), 4);
        n += RELPOS_MAC_BYTES;
    }
    relpos_put(raw + n, relpos_crc32(raw, n), 4);
    out[0] = 0;
    return 1 + relpos_stuff(raw, n + RELPOS_CRC_BYTES, out + 1);
}

/* Decode the bytes between two zeros, in place. With a key, frames without a right MAC are
   damaged; without one (NULL) MACs are not checked. */
static inline int relpos_decode(uint8_t *bytes, size_t n, const uint8_t *key, relpos_frame *f) {
    int known;
    if (n > RELPOS_MOST_CODED) return RELPOS_STRANGE;
    n = relpos_unstuff(bytes, n);
    if (n < RELPOS_HEADER_BYTES + RELPOS_CRC_BYTES || n > RELPOS_MOST_FRAME) return RELPOS_DAMAGED;
    n -= RELPOS_CRC_BYTES;
    if (relpos_crc32(bytes, n) != relpos_get(bytes + n, 4)) return RELPOS_DAMAGED;
    f->mac = bytes[0] & RELPOS_FLAG_MAC;
    if (f->mac) n -= RELPOS_MAC_BYTES;
    if (n < RELPOS_HEADER_BYTES || (key && !f->mac)) return RELPOS_DAMAGED;
    if (key && relpos_siphash(bytes, n, key) != relpos_word(bytes + n, 8)) return RELPOS_DAMAGED;
    if (bytes[0] >> 4 != RELPOS_VERSION || (bytes[0] & 15u & ~RELPOS_FLAG_MAC))
        return RELPOS_SKIPPED;
    f->type = bytes[1];
    f->node = (uint16_t)relpos_get(bytes + 2, 2);
    f->boot = relpos_get(bytes + 4, 4);
    f->sequence = relpos_get(bytes + 8, 4);
    f->time = relpos_get(bytes + 12, 4);
    known = relpos_unpack(f, bytes + RELPOS_HEADER_BYTES, n - RELPOS_HEADER_BYTES);
    return known < 0 ? RELPOS_SKIPPED : known ? RELPOS_OK : RELPOS_DAMAGED;
}

/* A stream of bytes; all zeros is its beginning. */
typedef struct {
    uint16_t n; /* bytes kept; one more than there is room for: the frame is too long */
    uint8_t bytes[RELPOS_MOST_CODED];
} relpos_receiver;

/* Take one byte; says RELPOS_OK when it ends a frame, which then is in `f`. */
static inline int relpos_receive(relpos_receiver *r, uint8_t byte, const uint8_t *key,
                                 relpos_frame *f) {
    size_t n = r->n;
    if (byte) {
        if (n < RELPOS_MOST_CODED) r->bytes[n] = byte;
        if (n <= RELPOS_MOST_CODED) r->n++;
        return RELPOS_NOTHING;
    }
    r->n = 0;
    return n == 0 ? RELPOS_NOTHING : relpos_decode(r->bytes, n, key, f);
}

#endif
