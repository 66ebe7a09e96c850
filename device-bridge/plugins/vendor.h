/* What the plug-ins for vendors' libraries share. Each is one source that includes this; all calls come from one thread. */
#ifndef TAUT_VENDOR_H
#define TAUT_VENDOR_H

#include <dlfcn.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "taut_device.h"

/* What went wrong last. */
static char text[256];

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

/* The number of `value`, which must be within. */
static bool number(const char *value, double low, double high, double *target)
{
    char *end;
    double read = strtod(value, &end);
    if (end == value || *end || !(read >= low && read <= high))
        return false;
    *target = read;
    return true;
}

/* s, of a clock that nobody sets. */
static inline double now(void)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

/* A function of the vendor's library; the first that is missing is named. */
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
