/* The functions of libdhd that plugins/dhd.c uses, around the simulated hand. Axes as the vendor's: x towards the user, y right, z up. Written from the
   published declarations; no code of the vendor's. */
#include <stdbool.h>
#include <string.h>
#include "plant.h"

enum { NOT_OFF, OFF_BY_BUTTON, OFF_BY_WATCHDOG = 3 };
static int enabled, is_open, expert, off;
static unsigned char watchdog = 8;
static const char *why = "";

int dhdOpenID(char id)
{
    if (taut_test_mode == UNPLUGGED)
        return why = "no device found", -1;
    is_open = 1;
    return id;
}
int dhdOpen(void) { return dhdOpenID(0); }
int dhdClose(char id)
{
    (void)id;
    if (watchdog != 8)
        return why = "the watchdog of before is lost", -1;
    render(0, 0);
    taut_test_closes++;
    is_open = enabled = 0;
    return 0;
}
int dhdEnableForce(unsigned char on, char id) { return (void)id, off = NOT_OFF, enabled = on, 0; }
int dhdEnableExpertMode(void) { return expert = 1, 0; }
int dhdDisableExpertMode(void) { return expert = 0, 0; }
int dhdGetWatchdog(unsigned char *steps, char id) { return (void)id, *steps = watchdog, expert - 1; }
int dhdSetWatchdog(unsigned char steps, char id) { return (void)id, watchdog = expert ? steps : watchdog, expert - 1; }
/* The force button was pressed in this mode. */
static int renders(void) { return enabled && !off && taut_test_mode != NOT_CALIBRATED; }
int dhdGetStatus(int *status, char id)
{
    (void)id;
    if (taut_test_mode == NOT_CALIBRATED)
        bad(NOT_CALIBRATED);
    status[5] = renders();
    status[14] = off ? off : OFF_BY_BUTTON; /* now, or the last time */
    return 0;
}
const char *dhdErrorGetLastStr(void) { return why; }
const char *dhdGetSystemName(char id) { return (void)id, "stand-in.6"; }
bool dhdHasWrist(char id) { return (void)id, true; }
bool dhdHasActiveWrist(char id) { return (void)id, true; }
unsigned dhdGetButtonMask(char id) { return (void)id, 2; }
int dhdGetPosition(double *x, double *y, double *z, char id)
{
    long long mode = taut_test_mode;
    (void)id;
    if (mode != NOT_CALIBRATED && bad(mode) && watchdog == 255) { /* nobody could write */
        off = OFF_BY_WATCHDOG;
        render(0, 0);
    }
    if (!is_open || mode == UNPLUGGED || mode == TOO_HOT)
        return why = "device communication error", -1;
    step();
    *x = 0.02; /* towards the user */
    *y = 0.03; /* right */
    *z = mode == NOT_A_NUMBER ? NAN : height;
    return mode == NOTHING_NEW;
}
int dhdGetLinearVelocity(double *x, double *y, double *z, char id)
{
    (void)id;
    *x = *y = 0;
    *z = rising;
    return 0;
}
int dhdGetAngularVelocityRad(double *x, double *y, double *z, char id) { return (void)id, *x = *y = *z = 0, 0; }
/* Turned by 2.5 rad about the axis towards the user. */
int dhdGetOrientationFrame(double m[3][3], char id)
{
    double c = cos(2.5), s = sin(2.5), frame[3][3] = {{1, 0, 0}, {0, c, -s}, {0, s, c}};
    (void)id;
    memcpy(m, frame, sizeof frame);
    return 0;
}
int dhdSetForceAndTorqueAndGripperForce(double fx, double fy, double fz, double tx, double ty, double tz, double grip, char id)
{
    (void)fx, (void)fy, (void)tx, (void)tz, (void)grip, (void)id;
    if (!is_open || expert || taut_test_mode == UNPLUGGED)
        return -1;
    render(renders() ? fz : 0, renders() ? ty : 0); /* their y is the user's x */
    return 0;
}
