/*
 * What a board has to provide for node_skeleton.c and car_skeleton.c.
 *
 * Nothing here waits: a loop that waits for one thing is late for all others.
 */
#ifndef BOARD_H
#define BOARD_H

#include <stddef.h>
#include <stdint.h>

/* A free-running counter of microseconds that wraps at 2^32. */
uint32_t board_micros(void);

/* A number that differs from start to start. With a key it must rise: a counter in flash. */
uint32_t board_boot_number(void);

/* Send all of it or nothing; 0 if there is no room in the buffer. */
int board_write(const uint8_t *bytes, size_t n);

/* One byte that came; 0 if there is none. */
int board_read(uint8_t *byte);

/* ---- of a node ---- */

typedef struct {
    uint32_t time;            /* board_micros() when the sensor said that it was ready */
    float gyr[3];             /* [rad/s] x forward, y left, z up of the car, not of the chip */
    float acc[3];             /* [m/s2] same axes; at rest +9.8 on z */
    float mag[3];             /* [uT] same axes */
    int has_mag;
} board_sample;

/* A new sample; 0 if there is none. */
int board_imu(board_sample *sample);

typedef struct {
    uint16_t to;              /* the other node */
    float distance;           /* [m] antenna to antenna, without the delay of both */
    int has_power;
    float rx_power, fp_power; /* [dBm] received, and of the first path */
} board_range;

/* The ranges of one round and when they were measured; 0 if there is no new round. */
size_t board_ranges(board_range *ranges, size_t most, uint32_t *time);

/* [V] of the battery. */
float board_volts(void);

/* ---- of a car ---- */

/* Regulate the speed [m/s], forward positive, and turn the front wheels [rad], left positive. */
void board_drive(float speed, float steering);

/* No motion, brakes on. */
void board_brake(void);

/* [m/s] by wheels or motor. */
float board_speed(void);

/* The highest boot number of a host that was obeyed before this start, kept in flash; 0 if none. */
uint32_t board_load_host_boot(void);
void board_store_host_boot(uint32_t boot);

#endif
