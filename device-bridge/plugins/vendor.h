/* What the plug-ins for vendors' libraries share. Each is one source that includes this first. */
#ifndef TAUT_VENDOR_H
#define TAUT_VENDOR_H
#define _POSIX_C_SOURCE 200809L

#include <dlfcn.h>
#include <math.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "taut_device.h"

#define OLDEST 0.02 /* s: of a force, and of a reading */

static int32_t device_open(const char *options, void **opened);
static int32_t device_info(void *opened, taut_device_info *info);
static int32_t device_read(void *opened, taut_device_sample *sample);
static int32_t device_write(void *opened, const double wrench[6]);
static int32_t device_close(void *opened);

/* What went wrong last, in the thread that is told of it. */
static _Thread_local char text[256];

static int fail(int code, const char *what, const char *why)
{
    snprintf(text, sizeof text, "%s: %s", what, why ? why : "no reason given");
    return code;
}

static void device_error_text(void *opened, char *to, size_t size)
{
    (void)opened;
    snprintf(to, size, "%s", text);
}

const taut_device_table *taut_device_entry(void)
{
    static const taut_device_table table = {
        TAUT_DEVICE_VERSION, sizeof table, device_open, device_info, device_read, device_write, device_close, device_error_text,
    };
    return &table;
}

/* What a device renders. */
struct limits {
    double force, torque, stiffness, rotational_stiffness;
};

static void describe(taut_device_info *info, const char *name, uint32_t sensed, uint32_t actuated, const struct limits *limits)
{
    snprintf(info->name, sizeof info->name, "%s", name);
    info->sensed_degrees_of_freedom = sensed;
    info->actuated_degrees_of_freedom = actuated;
    info->max_force = limits->force;
    info->max_torque = limits->torque;
    info->max_stiffness = limits->stiffness;
    info->max_rotational_stiffness = limits->rotational_stiffness;
    info->rate = 1000;
}

/* An option: a text that is not empty, or a number, which must be within. */
struct option {
    const char *name;
    const char **text;
    double *number, low, high;
    bool whole;
};
#define TEXT(name, target) {name, target, NULL, 0, 0, false}
#define NUMBER(name, low, high, target) {name, NULL, target, low, high, false}
#define WHOLE(name, low, high, target) {name, NULL, target, low, high, true}
#define WITH_TORQUE(limits) \
    NUMBER("force", 0.1, 100, &(limits).force), NUMBER("torque", 0.001, 10, &(limits).torque), NUMBER("stiffness", 1, 1e5, &(limits).stiffness), \
        NUMBER("rotational-stiffness", 0.001, 1e3, &(limits).rotational_stiffness)

static bool takes(const struct option *option, const char *value)
{
    char *end;
    double number;
    if (option->text)
        return *(*option->text = value) != 0;
    number = strtod(value, &end);
    if (end == value || *end || !(number >= option->low && number <= option->high) || (option->whole && number != floor(number)))
        return false;
    *option->number = number;
    return true;
}

/* Reads NAME=VALUE,... by the table `options`, whose last has no name; the texts stay in `copy`. */
static int read_options(const char *given, char copy[1024], const struct option *options)
{
    char *rest = NULL, known[160] = "no such option; there are";
    if (strlen(given) >= 1024)
        return fail(TAUT_DEVICE_FAILED, "options", "they are too long");
    for (const struct option *option = options; option->name; option++) {
        size_t end = strlen(known);
        snprintf(known + end, sizeof known - end, "%s %s", option == options ? "" : ",", option->name);
    }
    strcpy(copy, given);
    for (char *name = strtok_r(copy, ",", &rest); name; name = strtok_r(NULL, ",", &rest)) {
        const struct option *option = options;
        char *value = strchr(name, '=');
        if (!value)
            return fail(TAUT_DEVICE_FAILED, "write NAME=VALUE instead of", name);
        *value++ = 0;
        while (option->name && strcmp(option->name, name))
            option++;
        if (!option->name)
            return fail(TAUT_DEVICE_FAILED, known, name);
        if (!takes(option, value))
            return fail(TAUT_DEVICE_FAILED, "no value for this option, or out of range", name);
    }
    return TAUT_DEVICE_OK;
}

/* s, of a clock that nobody sets. */
static inline double now(void)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

/* The vendor's library, loaded once. */
static int loaded(void **library, const char *path, const char *whose)
{
    char what[96];
    if (!*library)
        *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    snprintf(what, sizeof what, "%s library cannot be loaded (install it; option library=PATH)", whose);
    return *library ? TAUT_DEVICE_OK : fail(TAUT_DEVICE_FAILED, what, dlerror());
}

/* A function of it; the first that is missing is named. */
static void *symbol(void *library, const char *name, const char **missing)
{
    void *found = dlsym(library, name);
    if (!found && missing && !*missing)
        *missing = name;
    return found;
}

/* The end of loading it: one that lacks a function is closed again. */
static int complete(void **library, const char *missing)
{
    if (!missing)
        return TAUT_DEVICE_OK;
    dlclose(*library);
    *library = NULL;
    return fail(TAUT_DEVICE_FAILED, "the library is too old or another one: it lacks", missing);
}

/* w x y z of a rotation matrix, by the largest of the four. NaN stays NaN. */
static inline void quaternion(double m[3][3], double q[4])
{
    double trace = m[0][0] + m[1][1] + m[2][2], largest = trace, norm = 0;
    int at = -1;
    for (int i = 0; i < 3; i++)
        if (m[i][i] > largest) {
            largest = m[i][i];
            at = i;
        }
    if (at < 0) {
        q[0] = 1 + trace;
        q[1] = m[2][1] - m[1][2];
        q[2] = m[0][2] - m[2][0];
        q[3] = m[1][0] - m[0][1];
    } else {
        int b = (at + 1) % 3, c = (at + 2) % 3;
        q[0] = m[c][b] - m[b][c];
        q[1 + at] = 1 + m[at][at] - m[b][b] - m[c][c];
        q[1 + b] = m[b][at] + m[at][b];
        q[1 + c] = m[c][at] + m[at][c];
    }
    for (int i = 0; i < 4; i++)
        norm += q[i] * q[i];
    for (int i = 0; i < 4; i++)
        q[i] /= sqrt(norm);
}

/* From the vendor's axes to x right, y away from the user, z up: each plug-in's own. */
static void turned(const double from[3], double to[3]);

/* The quaternion of a rotation in the vendor's axes: M R M^T, both indices go to ours. */
static inline void turned_rotation(double frame[3][3], double q[4])
{
    double rows[3][3], seen[3][3];
    for (int row = 0; row < 3; row++)
        turned(frame[row], rows[row]);
    for (int column = 0; column < 3; column++) {
        double from[3] = {rows[0][column], rows[1][column], rows[2][column]}, to[3];
        turned(from, to);
        for (int row = 0; row < 3; row++)
            seen[row][column] = to[row];
    }
    quaternion(seen, q);
}

#endif
