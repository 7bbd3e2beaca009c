/*
 * A computer in place of a board, to try the skeletons before there is one. Time goes in steps of
 * a millisecond, as fast as it can.
 *
 *     cc -std=c99 -I hardware_bridge/wire -DNODE -o node examples/firmware/node_skeleton.c
 *        examples/firmware/computer.c
 *     ./node 2000 > node.bin            two seconds of a node that lies still
 *     cc ... -DCAR -o car examples/firmware/car_skeleton.c examples/firmware/computer.c
 *     ./car 1000 < commands.txt         lines of a time [ms] and the bytes that came then, in hex
 *
 * The commands of the motor go to stderr: time [ms], speed [m/s], steering [rad], or "brake".
 */
#include "board.h"

#include <stdio.h>
#include <stdlib.h>

#define START 4294000000u /* [us] The counter wraps after a second, as a real one does some day. */

static uint32_t now, elapsed_ms;

#ifdef NODE
void node_start(void);
void node_loop(void);
#define START_ALL node_start
#define LOOP node_loop

static uint32_t next_sample, next_round;

int board_imu(board_sample *s) {
    const board_sample still = {
        0, {0.01f, -0.02f, 0.03f}, {0.0f, 0.0f, 9.81f}, {20.0f, 0.0f, -43.0f}, 1};
    if (elapsed_ms < next_sample) return 0;
    next_sample += 10;
    *s = still;
    /* A sensor that works has noise; one that repeats itself to the last digit is taken for stuck. */
    s->acc[2] += (next_sample / 10) % 2 ? 0.002f : -0.002f;
    s->time = now;
    return 1;
}

size_t board_ranges(board_range *ranges, size_t most, uint32_t *time) {
    const board_range seen[2] = {{2, 1.5f, 1, -81.0f, -83.5f}, {3, 2.25f, 0, 0.0f, 0.0f}};
    size_t k;
    if (elapsed_ms < next_round) return 0;
    next_round += 20;
    for (k = 0; k < 2 && k < most; k++) ranges[k] = seen[k];
    *time = now;
    return k;
}

float board_volts(void) { return 7.4f; }

static void take_input(void) {}

int board_read(uint8_t *byte) {
    (void)byte;
    return 0;
}
#else
void car_start(void);
void car_loop(void);
#define START_ALL car_start
#define LOOP car_loop

static uint8_t waiting[4096];
static size_t n_waiting, n_read;
static unsigned long due;
static int has_line;
static float speed_now;

/* Bytes whose time has come. */
static void take_input(void) {
    char text[3] = {0, 0, 0};
    int c;
    n_waiting = n_read = 0;
    for (;;) {
        if (!has_line && scanf("%lu", &due) != 1) return;
        has_line = 1;
        if (due > elapsed_ms) return;
        has_line = 0;
        while ((c = getchar()) != EOF && c != '\n') {
            if (c == ' ') continue;
            text[0] = (char)c;
            text[1] = (char)getchar();
            if (n_waiting < sizeof waiting)
                waiting[n_waiting++] = (uint8_t)strtoul(text, NULL, 16);
        }
    }
}

int board_read(uint8_t *byte) {
    if (n_read == n_waiting) return 0;
    *byte = waiting[n_read++];
    return 1;
}

void board_drive(float speed, float steering) {
    speed_now = speed;
    fprintf(stderr, "%lu %.3f %.3f\n", (unsigned long)elapsed_ms, (double)speed, (double)steering);
}

void board_brake(void) {
    speed_now = 0.0f;
    fprintf(stderr, "%lu brake\n", (unsigned long)elapsed_ms);
}

float board_speed(void) { return speed_now; }

/* A real board keeps it in flash. */
static uint32_t stored;
uint32_t board_load_host_boot(void) { return stored; }
void board_store_host_boot(uint32_t boot) { stored = boot; }
#endif

uint32_t board_micros(void) { return now; }

uint32_t board_boot_number(void) { return 7; }

int board_write(const uint8_t *bytes, size_t n) { return fwrite(bytes, 1, n, stdout) == n; }

int main(int argc, char **argv) {
    unsigned long most = argc > 1 ? strtoul(argv[1], NULL, 10) : 1000;
    now = START;
    START_ALL();
    for (elapsed_ms = 0; elapsed_ms < most; elapsed_ms++, now += 1000) {
        take_input();
        LOOP();
    }
    return 0;
}
