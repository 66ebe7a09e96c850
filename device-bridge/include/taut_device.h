/*
 * A force device of your own, in C: a shared library that exports taut_device_entry.
 *
 * taut bridge --device plugin:/path/to/library.so[,options]
 *
 * Units   SI: m, m/s, rad/s, N, N m, s.
 * Frame   the device's own axes, right-handed; where nothing is configured they are taken as x right, y away from the user, z up. All vectors are in
 *         these axes, angular velocity and torque too. Position, velocity and torque are those of the grip's reference point.
 * Thread  all functions are called from one thread that belongs to this device alone, one at a time, about once a millisecond: read, then write.
 *         taut_device_entry comes from the same thread. The library may have threads of its own.
 * Time    read and write return within a millisecond and wait for no device: nothing new is an answer. Open may take 5 s, close half a second.
 *         While a call hangs, taut takes the force command to zero (hold 20 ms, then fade), but cannot hand that to the library: it is the
 *         first command after the call returns. So the library or its hardware must let go by itself when 20 ms pass without a write.
 * Ends    close must take the force to zero first, even where the device is gone. It is called once for each open that succeeded, also after an
 *         error. It is not called when the process is killed: that is for the watchdog of the hardware.
 */
#ifndef TAUT_DEVICE_H
#define TAUT_DEVICE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Changes with every change of a structure or of a meaning in this file. */
#define TAUT_DEVICE_VERSION 1u

/* What open, info, read, write and close return. Any other value counts as TAUT_DEVICE_FAILED. */
enum {
    TAUT_DEVICE_OK = 0,
    /* read: no newer sample than the last. After 20 ms of it the device counts as lost, and the force goes.
       write: the wrench was not rendered and the motors are at zero, as after a watchdog of the device's own; the next ones begin there. */
    TAUT_DEVICE_NOTHING_NEW = 1,
    /* read, write: there, but without a pose that may be used (not calibrated, no power). Calls go on; the force fades, or after a write
       begins at zero. */
    TAUT_DEVICE_NOT_READY = 2,
    /* Unplugged. No force; taut calls close, and open again every 0.2 s. */
    TAUT_DEVICE_GONE = 3,
    /* Anything else. As TAUT_DEVICE_GONE. */
    TAUT_DEVICE_FAILED = 4
};

/* What the device is. Constant from open to close, and the same after it was unplugged and is back. */
typedef struct taut_device_info {
    char name[64];                     /* for people, UTF-8, ends with 0 */
    uint32_t sensed_degrees_of_freedom;   /* 3 (position) or 6 */
    uint32_t actuated_degrees_of_freedom; /* 0 (no motors), 3 (force) or 6 (force and torque, 6 sensed) */
    double max_force;                  /* N, above 0, at most 1000; not read without motors, as the next three */
    double max_torque;                 /* N m, above 0, at most 100; read with 6 actuated, as the last */
    double max_stiffness;              /* N/m that it renders without oscillation, above 0, at most 1e6 */
    double max_rotational_stiffness;   /* N m/rad, above 0, at most 1e4 */
    double rate;                       /* Hz at which it may be read and written: 200 to 100000. taut calls at most 1000 times a second */
} taut_device_info;

/* taut_device_sample.measured */
#define TAUT_DEVICE_HAS_ANGULAR_VELOCITY 1u

/* One reading. taut fills every number with NaN before read: what is not set is refused. */
typedef struct taut_device_sample {
    double position[3];         /* m, at most 10 along each axis */
    double orientation[4];      /* w x y z, of unit length within 1e-3; not read with 3 sensed */
    double velocity[3];         /* m/s, at most 100 along each axis */
    double angular_velocity[3]; /* rad/s, at most 1000; read with TAUT_DEVICE_HAS_ANGULAR_VELOCITY, else taken from orientations */
    double age;                 /* s since it was measured, 0 to 1; from 0.02 on it counts as nothing new */
    uint32_t buttons;           /* bit 0 the first, 16 at most */
    uint32_t measured;          /* TAUT_DEVICE_HAS_..., else 0 */
} taut_device_sample;

/* The functions. All are there. */
typedef struct taut_device_table {
    uint32_t version; /* TAUT_DEVICE_VERSION */
    uint32_t size;    /* sizeof(taut_device_table) */
    /* Finds and prepares the device, without force. `options` is what followed the path on the command line, "" where nothing did; valid during the
       call. On TAUT_DEVICE_OK `*device` is what the others get; else close is not called. */
    int32_t (*open)(const char *options, void **device);
    int32_t (*info)(void *device, taut_device_info *info);
    int32_t (*read)(void *device, taut_device_sample *sample);
    /* Force then torque on the hand, N and N m, finite, within what info says, until the next write. Torque is zero with 3 actuated. Not called
       without motors. */
    int32_t (*write)(void *device, const double wrench[6]);
    int32_t (*close)(void *device);
    /* What went wrong last, UTF-8, into `text` of `size` bytes with a 0 at the end. `device` is NULL after an open that failed. */
    void (*error_text)(void *device, char *text, size_t size);
} taut_device_table;

#if defined(_WIN32)
#define TAUT_DEVICE_EXPORT __declspec(dllexport)
#else
#define TAUT_DEVICE_EXPORT __attribute__((visibility("default")))
#endif

/* The one function that a library exports. The table stays valid and unchanged for as long as the process lives; NULL refuses. */
TAUT_DEVICE_EXPORT const taut_device_table *taut_device_entry(void);

#ifdef __cplusplus
}
#endif
#endif
