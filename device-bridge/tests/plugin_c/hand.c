/* A device that is a simulated hand on a grip; and, by macros, the ways in which a plug-in may not fit. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "plant.h"
#ifdef NO_ENTRY
#define taut_device_entry some_other_function
#endif
#include "taut_device.h"

static const char *why = "";
static int watch;

static int32_t hand_open(const char *options, void **device)
{
    if (taut_test_mode == UNPLUGGED)
        return why = "no hand is plugged in", TAUT_DEVICE_GONE;
    if (*options && strcmp(options, "side=left,firm"))
        return why = "what options are these?", TAUT_DEVICE_FAILED;
    *device = &height;
    return TAUT_DEVICE_OK;
}

static int32_t hand_info(void *device, taut_device_info *info)
{
    (void)device;
    strcpy(info->name, "stand-in hand");
    info->sensed_degrees_of_freedom = info->actuated_degrees_of_freedom = 6;
#ifdef INFINITE
    info->max_force = INFINITY;
#else
    info->max_force = 12;
#endif
#ifdef NO_MOTORS
    info->actuated_degrees_of_freedom = 0;
#endif
    info->max_torque = 0.5;
    info->max_stiffness = 1500;
    info->max_rotational_stiffness = 2;
    info->rate = 1000;
    return TAUT_DEVICE_OK;
}

static int32_t hand_read(void *device, taut_device_sample *sample)
{
    long long mode = taut_test_mode;
    double length = mode == LONG_QUATERNION ? 1.2 : 1;
    (void)device;
    if (bad(mode))
        watch = 1;
    step();
    switch (mode) {
    case TOO_HOT: return why = "the motors are too hot", 17;
    case UNPLUGGED: return why = "the cable is out", TAUT_DEVICE_GONE;
    case NOTHING_NEW: return TAUT_DEVICE_NOTHING_NEW;
    case NOT_CALIBRATED: return TAUT_DEVICE_NOT_READY;
    default: break;
    }
    sample->position[0] = sample->position[1] = 0;
    sample->position[2] = mode == NOT_A_NUMBER ? NAN : height;
    sample->velocity[0] = sample->velocity[1] = 0;
    sample->velocity[2] = rising;
    memset(sample->orientation, 0, sizeof sample->orientation);
    sample->orientation[0] = length;
    memset(sample->angular_velocity, 0, sizeof sample->angular_velocity);
    sample->measured = TAUT_DEVICE_HAS_ANGULAR_VELOCITY;
    sample->age = 0;
    sample->buttons = 5;
    return TAUT_DEVICE_OK;
}

static int32_t hand_write(void *device, const double wrench[6])
{
    (void)device;
#ifdef NO_MOTORS
    abort();
#endif
    render(wrench[2], wrench[3]);
    if (watch) {
        watch = 0;
        taut_test_after = taut_test_force;
    }
    return TAUT_DEVICE_OK;
}

static int32_t hand_close(void *device)
{
    (void)device;
    render(0, 0);
    taut_test_closes++;
    return TAUT_DEVICE_OK;
}

static void hand_text(void *device, char *text, size_t size)
{
    (void)device;
    snprintf(text, size, "%s", why);
}

const taut_device_table *taut_device_entry(void)
{
    static taut_device_table table = {TAUT_DEVICE_VERSION, sizeof table, hand_open, hand_info, hand_read, hand_write, hand_close, hand_text};
#ifdef OTHER_VERSION
    table.version = 9;
#endif
#ifdef OTHER_SIZE
    table.size -= 8;
#endif
#ifdef HOLE
    table.write = 0;
#endif
#ifdef NO_TABLE
    return 0;
#endif
    return &table;
}
