/*
 * A node: what it measures goes out in the wire format `relpos`, see docs/reference/wire-format.md.
 *
 * It is plain C99 over board.h. Call node_start() once and node_loop() as often as possible, a
 * thousand times a second or more. The board's own work is to range the others; docs/reference/protocol.md
 * has a protocol for that.
 */
#include "board.h"
#include "relpos_wire.h"

#ifndef MY_NODE
#define MY_NODE 1u
#endif
#ifdef MY_KEY /* sixteen bytes, {0x00, 0x11, ...}; the same as `key` in swarm.toml */
static const uint8_t key_bytes[RELPOS_KEY_BYTES] = MY_KEY;
static const uint8_t *const key = key_bytes;
#else
static const uint8_t *const key = NULL;
#endif

#define STATUS_EVERY 1000000u /* [us] */
#define MOST_RANGES 16u

void node_start(void);
void node_loop(void);

static uint32_t boot, sequence, last_status;

/* `time` is when it was measured, not when it is sent. */
static void send(relpos_frame *f, uint8_t type, uint32_t time) {
    uint8_t bytes[RELPOS_MOST_BYTES];
    size_t n;
    f->type = type;
    f->node = MY_NODE;
    f->boot = boot;
    /* Counted even if there is no room: so the host knows what it missed. */
    f->sequence = sequence++;
    f->time = time;
    n = relpos_encode(f, key, bytes);
    if (n) (void)board_write(bytes, n);
}

static void send_sample(const board_sample *s) {
    relpos_frame f;
    size_t k;
    if (s->has_mag) {
        for (k = 0; k < 3; k++)
            if (!relpos_imu_mag_set_gyr(&f.of.imu_mag, k, s->gyr[k])
                || !relpos_imu_mag_set_acc(&f.of.imu_mag, k, s->acc[k])
                || !relpos_imu_mag_set_mag(&f.of.imu_mag, k, s->mag[k]))
                return; /* not a number */
        send(&f, RELPOS_IMU_MAG, s->time);
        return;
    }
    for (k = 0; k < 3; k++)
        if (!relpos_imu_set_gyr(&f.of.imu, k, s->gyr[k])
            || !relpos_imu_set_acc(&f.of.imu, k, s->acc[k]))
            return;
    send(&f, RELPOS_IMU, s->time);
}

static void send_ranges(const board_range *ranges, size_t n, uint32_t time) {
    relpos_frame f;
    size_t k;
    f.of.ranges.n = 0;
    for (k = 0; k < n && f.of.ranges.n < RELPOS_MOST_ROWS; k++) {
        relpos_ranges_row *row = &f.of.ranges.row[f.of.ranges.n];
        const relpos_ranges_row nothing = {0};
        *row = nothing;
        row->to = ranges[k].to;
        if (!relpos_ranges_row_set_distance(row, ranges[k].distance)) continue;
        if (ranges[k].has_power && relpos_ranges_row_set_rx_power(row, ranges[k].rx_power)
            && relpos_ranges_row_set_fp_power(row, ranges[k].fp_power))
            row->has = RELPOS_RANGES_HAS_RX_POWER | RELPOS_RANGES_HAS_FP_POWER;
        f.of.ranges.n++;
    }
    /* What was not measured is not sent: no 0, no last value once more. */
    if (f.of.ranges.n) send(&f, RELPOS_RANGES, time);
}

static void send_status(uint32_t now) {
    relpos_frame f;
    f.of.status.fault = 0;
    f.of.status.voltage = 0;
    f.of.status.has = 0;
    if (relpos_status_set_voltage(&f.of.status, board_volts()))
        f.of.status.has = RELPOS_STATUS_HAS_VOLTAGE;
    send(&f, RELPOS_STATUS, now);
}

void node_start(void) {
    boot = board_boot_number();
    sequence = 0;
    last_status = board_micros();
}

void node_loop(void) {
    board_sample sample;
    board_range ranges[MOST_RANGES];
    uint32_t time = 0, now;
    size_t n;
    while (board_imu(&sample)) send_sample(&sample);
    n = board_ranges(ranges, MOST_RANGES, &time);
    if (n) send_ranges(ranges, n, time);
    now = board_micros();
    if (now - last_status >= STATUS_EVERY) {
        last_status = now;
        send_status(now);
    }
}
