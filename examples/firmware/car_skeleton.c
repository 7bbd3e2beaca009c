/*
 * A car that obeys the driver `relpos`, see docs/reference/drivers.md, and stops by itself.
 *
 * It is plain C99 over board.h. Call car_start() once and car_loop() as often as possible. It has
 * a port of its own, and numbers of its own: a board that is node and car has two of both. Switch
 * the microcontroller's watchdog on as well: it stops the car when this loop does not run.
 */
#include "board.h"
#include "relpos_wire.h"

#ifndef MY_NODE
#define MY_NODE 1u /* the node that this car carries */
#endif
#ifdef MY_KEY /* sixteen bytes, {0x00, 0x11, ...}; the same as `key` of the car in swarm.toml */
static const uint8_t key_bytes[RELPOS_KEY_BYTES] = MY_KEY;
static const uint8_t *const key = key_bytes;
#else
static const uint8_t *const key = NULL;
#endif

#define DEADMAN 200000u     /* [us] without a command, then the car stops */
#define MOST_LATE 100000u   /* [us] later than the quickest before, a command is old */
#define MOTION_EVERY 20000u /* [us] */
#define MOST_SPEED 1.0f     /* [m/s] whatever is asked */
#define MOST_STEERING 0.42f /* [rad] */

void car_start(void);
void car_loop(void);

static relpos_receiver receiver; /* begins with zeros */
static uint32_t boot, sequence, last_motion, last_command, last_received;
static uint32_t host_boot, host_sequence, least_boot, least_delay;
static int has_host, moves;
static float steering_now;

static void send(relpos_frame *f, uint8_t type, uint32_t time) {
    uint8_t bytes[RELPOS_MOST_BYTES];
    size_t n;
    f->type = type;
    f->node = MY_NODE;
    f->boot = boot;
    f->sequence = sequence++;
    f->time = time;
    n = relpos_encode(f, key, bytes);
    if (n) (void)board_write(bytes, n);
}

static float within(float value, float most) {
    return value > most ? most : value < -most ? -most : value;
}

static void stop(void) {
    moves = 0;
    board_brake();
}

/* Whether a command was never seen before: what was recorded must move nothing again. */
static int is_new(uint32_t its_boot, uint32_t its_sequence) {
    if (has_host && its_boot == host_boot) return its_sequence > host_sequence;
    /* With a key only later starts of the host count. A car that restarts in the middle of a
       drive remains stopped until the host is restarted, too. */
    if (key && its_boot <= least_boot) return 0;
    return 1;
}

/* Whether a command was held up on its way: a network that was gone delivers old ones when it is
   back. Both counters run free, so only differences of delays mean something; the least delay may
   grow by a thousandth of the time, more than two clocks drift apart. */
static int is_late(uint32_t its_time, uint32_t now, int is_first) {
    uint32_t delay = now - its_time;
    if (is_first) {
        least_delay = delay;
        return 0;
    }
    least_delay += (now - last_received) / 1000u;
    if (delay - least_delay >= 0x80000000u) least_delay = delay; /* quicker than any before */
    return delay - least_delay > MOST_LATE;
}

static void obey(const relpos_frame *f, uint32_t now) {
    const relpos_command *command = &f->of.command;
    relpos_frame answer;
    int is_first, late;
    if (f->type != RELPOS_COMMAND || f->node != RELPOS_HOST || command->to != MY_NODE) return;
    if (!is_new(f->boot, f->sequence)) return;
    is_first = !has_host || f->boot != host_boot;
    if (key && is_first) {
        least_boot = f->boot;
        board_store_host_boot(f->boot);
    }
    late = is_late(f->time, now, is_first);
    has_host = 1;
    host_boot = f->boot;
    host_sequence = f->sequence;
    last_received = now;
    if (late && !(command->flags & RELPOS_COMMAND_FLAGS_BRAKE)) return;
    last_command = now;
    if (command->flags & RELPOS_COMMAND_FLAGS_BRAKE) {
        stop();
    } else {
        moves = 1;
        steering_now = within(relpos_command_steering(command), MOST_STEERING);
        board_drive(within(relpos_command_speed(command), MOST_SPEED), steering_now);
    }
    answer.of.ack.command = f->sequence;
    send(&answer, RELPOS_ACK, now);
}

static void send_motion(uint32_t now) {
    relpos_frame f;
    if (!relpos_motion_set_speed(&f.of.motion, board_speed())) return;
    f.of.motion.steering = 0;
    f.of.motion.has = 0;
    if (relpos_motion_set_steering(&f.of.motion, steering_now))
        f.of.motion.has = RELPOS_MOTION_HAS_STEERING;
    send(&f, RELPOS_MOTION, now);
}

void car_start(void) {
    boot = board_boot_number();
    sequence = 0;
    last_motion = board_micros();
    has_host = 0;
    least_boot = board_load_host_boot();
    stop();
}

void car_loop(void) {
    relpos_frame f;
    uint32_t now = board_micros();
    uint8_t byte;
    /* First, so that no amount of bytes keeps the car from it. `moves` is asked as well: the
       difference of two times begins at 0 again after 71.6 minutes. */
    if (moves && now - last_command >= DEADMAN) stop();
    while (board_read(&byte))
        if (relpos_receive(&receiver, byte, key, &f) == RELPOS_OK) obey(&f, now);
    if (now - last_motion >= MOTION_EVERY) {
        last_motion = now;
        send_motion(now);
    }
}
