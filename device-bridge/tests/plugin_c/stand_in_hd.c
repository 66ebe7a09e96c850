/* The functions of libHD that plugins/hd.c uses, around the simulated hand, with a servo thread. Axes as the vendor's: x right, y up, z towards the user; mm.
   Written from the published declarations; no code of the vendor's. */
#define _DEFAULT_SOURCE
#include <pthread.h>
#include <stdatomic.h>
#include <string.h>
#include "plant.h"

typedef struct {
    unsigned code;
    int internal;
    unsigned device;
} HDErrorInfo;

static int enabled;
static _Atomic int runs;
static _Atomic unsigned error, warning; /* the newer one */
static _Atomic int calibrated; /* what the inkwell said is taken over */
static unsigned (*callback)(void *);
static void *user;
static pthread_t thread;

HDErrorInfo hdGetError(void)
{
    HDErrorInfo last = {atomic_exchange(&warning, 0), 0, 0};
    if (!last.code)
        last.code = atomic_exchange(&error, 0);
    return last;
}
const char *hdGetErrorString(unsigned code) { return code == 0x0302 ? "no device found" : "device fault"; }
unsigned hdInitDevice(const char *name)
{
    if (taut_test_mode != UNPLUGGED && (!name || !strcmp(name, "Left Device")))
        return 7;
    error = 0x0302;
    return 0xffffffffu;
}
void hdDisableDevice(unsigned device)
{
    (void)device;
    render(0, 0);
    taut_test_closes++;
    enabled = 0;
}
void hdBeginFrame(unsigned device) { (void)device; }
void hdEndFrame(unsigned device)
{
    (void)device;
    if (taut_test_mode == UNPLUGGED)
        error = 0x0302;
    if (taut_test_mode == TOO_HOT)
        error = 0x0300;
    if (error)
        warning = 0x0201; /* and the force was too large */
}
void hdEnable(unsigned what) { enabled |= what == 0x4000; }
const char *hdGetString(unsigned what) { return what == 0x2501 ? "stand-in Touch" : 0; }
unsigned hdCheckCalibration(void)
{
    if (taut_test_mode == NOT_CALIBRATED) {
        calibrated = 0;
        return 0x5002;
    }
    return calibrated ? 0x5000 : 0x5001;
}
void hdUpdateCalibration(unsigned style) { calibrated = style == 4; }
/* Turned by 2.5 rad about the axis to the right; 30 mm right, 20 mm towards the user. */
void hdGetDoublev(unsigned what, double *to)
{
    double c = cos(2.5), s = sin(2.5);
    double transform[16] = {1, 0, 0, 0, 0, c, s, 0, 0, -s, c, 0, 30, height * 1e3, 20, 1}, velocity[3] = {0, rising * 1e3, 0};
    if (what == 0x2052) {
        step();
        if (taut_test_mode == NOT_A_NUMBER)
            transform[13] = NAN;
        if (!calibrated)
            transform[12] += 70;
        memcpy(to, transform, sizeof transform);
    }
    if (what == 0x2051)
        memcpy(to, velocity, sizeof velocity);
}
/* Buttons; ways of calibration: encoders set by hand, and an inkwell. */
void hdGetIntegerv(unsigned what, int *to) { *to = what == 0x2000 ? 2 : what == 0x2555 ? 1 | 4 : -1; }
void hdSetDoublev(unsigned what, const double *from)
{
    if (what == 0x2700)
        render(enabled ? from[1] : 0, 0);
}
unsigned long hdScheduleAsynchronous(unsigned (*function)(void *), void *data, unsigned short priority)
{
    (void)priority;
    callback = function;
    user = data;
    return 1;
}
static void *servo(void *nothing)
{
    int frames = 0; /* in this mode: what a frame says takes another two to be read */
    while (runs) {
        usleep(1000);
        frames = taut_test_mode == GOOD ? 0 : frames + 1;
        if (frames > 5)
            bad(taut_test_mode);
        if (callback && !callback(user))
            callback = 0;
    }
    return nothing;
}
void hdStartScheduler(void)
{
    runs = 1;
    pthread_create(&thread, 0, servo, 0);
}
void hdStopScheduler(void)
{
    runs = 0;
    pthread_join(thread, 0);
}
void hdUnschedule(unsigned long handle) { (void)handle; }
