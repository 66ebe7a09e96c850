/* A hand that leans on a grip: what the stand-in libraries of the tests move, a millisecond a step; and what a test sees and switches. */
#include <math.h>
#include <stdatomic.h>
#include <unistd.h>

enum { GOOD, HANGS, NOT_A_NUMBER, LONG_QUATERNION, TOO_HOT, UNPLUGGED, NOTHING_NEW, NOT_CALIBRATED };

_Atomic long long taut_test_mode;   /* of the above; set by the test */
_Atomic long long taut_test_served; /* reads that were answered in a mode other than GOOD, or hang */
_Atomic long long taut_test_force;  /* upwards, what the motors render, uN */
_Atomic long long taut_test_torque; /* about the user's x, uN m */
_Atomic long long taut_test_after;  /* the first force after a hang, uN; -1 before */
_Atomic long long taut_test_closes; /* closes with the force at zero */
_Atomic long long taut_test_writes; /* forces that were written */
_Atomic long long taut_test_jump;   /* the largest change from one to the next, uN */
_Atomic long long taut_test_fall;   /* the largest that was let go, uN */

static double height, rising, pushed;

/* 0.2 kg, drawn towards 30 mm below the start. */
static void step(void)
{
    double force = pushed + 100 * (-0.03 - height) - 8 * rising;
    rising += force / 0.2 * 1e-3;
    height += rising * 1e-3;
}

static void render(double force, double torque)
{
    long long change = (long long)(fabs(force - pushed) * 1e6);
    _Atomic long long *largest = force == 0 ? &taut_test_fall : &taut_test_jump;
    if (change > *largest)
        *largest = change;
    taut_test_writes++;
    pushed = force;
    taut_test_force = (long long)(force * 1e6);
    taut_test_torque = (long long)(torque * 1e6);
}

/* Counts a bad answer, and waits for as long as the mode says so. Returns whether it hung. */
static int bad(long long mode)
{
    if (mode == GOOD)
        return 0;
    taut_test_served++;
    if (mode != HANGS)
        return 0;
    while (taut_test_mode == HANGS)
        usleep(1000);
    return 1;
}
