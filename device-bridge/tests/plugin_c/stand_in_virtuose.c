/* The functions of the Virtuose API that plugins/virtuose.c uses, around the simulated hand. Axes as the vendor's: x towards the user, y right, z up. Written
   from the published declarations; no code of the vendor's. */
#include <string.h>
#include "plant.h"

static int context, step_is_told, factors, framed, typed, powered;
static int error;

static int failed(int code) { return error = code, -1; }

int virtGetErrorCode(void *vc) { return (void)vc, error; }
const char *virtGetErrorMessage(int code) { return code == 2 ? "no device found" : "wrong order of calls"; }
void *virtOpen(const char *host)
{
    if (taut_test_mode == UNPLUGGED || strcmp(host, "10.0.0.7#53210"))
        return failed(2), (void *)0;
    step_is_told = factors = framed = typed = powered = 0;
    return &context;
}
int virtClose(void *vc)
{
    (void)vc;
    if (powered || pushed != 0)
        return failed(17);
    taut_test_closes++;
    return 0;
}
int virtSetIndexingMode(void *vc, int mode) { return (void)vc, mode == 3 ? 0 : failed(9); }
int virtSetForceFactor(void *vc, float factor) { return (void)vc, factors += factor == 1, 0; }
int virtSetSpeedFactor(void *vc, float factor) { return (void)vc, factors += factor == 1, 0; }
int virtSetTimeStep(void *vc, float s) { return (void)vc, step_is_told = s == 0.001f, 0; }
static int frame(const float *at)
{
    for (int i = 0; i < 7; i++)
        if (at[i] != (i == 6))
            return failed(9);
    framed++;
    return 0;
}
int virtSetBaseFrame(void *vc, float *at) { return (void)vc, frame(at); }
int virtSetObservationFrame(void *vc, float *at) { return (void)vc, frame(at); }
int virtSetCommandType(void *vc, int type)
{
    (void)vc;
    typed = type == 3 && step_is_told && factors == 2 && framed == 2;
    return typed ? 0 : failed(17);
}
int virtSetPowerOn(void *vc, int on)
{
    (void)vc;
    if (!on)
        render(0, 0);
    return powered = on, 0;
}
int virtGetPowerOn(void *vc, int *on) { return (void)vc, *on = powered && taut_test_mode != NOT_CALIBRATED, 0; }
int virtIsInShiftPosition(void *vc, int *indexes) { return (void)vc, *indexes = taut_test_mode == NOTHING_NEW, 0; } /* offset button */
int virtGetButton(void *vc, int number, int *pressed) { return (void)vc, *pressed = number == 2, 0; }
/* Turned by 2.5 rad about the axis towards the user. */
int virtGetPosition(void *vc, float *pose)
{
    long long mode = taut_test_mode;
    (void)vc;
    bad(mode);
    if (mode == UNPLUGGED || mode == TOO_HOT)
        return failed(2);
    step();
    pose[0] = 0.02f; /* towards the user */
    pose[1] = 0.03f; /* right */
    pose[2] = mode == NOT_A_NUMBER ? NAN : (float)height;
    pose[3] = sinf(1.25f);
    pose[4] = pose[5] = 0;
    pose[6] = cosf(1.25f);
    return 0;
}
int virtGetSpeed(void *vc, float *speed)
{
    (void)vc;
    memset(speed, 0, 6 * sizeof *speed);
    speed[2] = (float)rising;
    return 0;
}
int virtSetForce(void *vc, float *force)
{
    (void)vc;
    if (!typed || taut_test_mode == UNPLUGGED)
        return failed(2);
    render(powered ? force[2] : 0, powered ? force[4] : 0); /* their y is the user's x */
    return 0;
}
