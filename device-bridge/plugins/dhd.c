/*
 * Force Dimension's devices (omega, delta, sigma, lambda) as a plug-in of taut, by the vendor's own library, which is loaded at run time.
 *
 *   cc -std=c11 -O2 -shared -fPIC -I include -o taut_dhd.so plugins/dhd.c -ldl -lm -lpthread
 *   taut bridge --device plugin:/path/taut_dhd.so,library=/path/libdhd.so,force=5,...
 *
 * Options: library (default libdhd.so), id (device number, default the first), force (N, 5), torque (N m, 0.1), stiffness (N/m, 1000),
 * rotational-stiffness (N m/rad, 0.5): what the device renders, from its data sheet. The defaults are small on purpose.
 *
 * Names, order of arguments and units are those of the published header (dhdc.h 3.2 and later) and of public programs that use it: m, m/s, rad/s, N, N m;
 * a device's number is a char; results below 0 are errors, 1 (DHD_TIMEGUARD) is the reading of before, 2 (DHD_MOTOR_SATURATED) a force that was
 * cut. Axes there: x towards the user, y right, z up. Here: x right, y away, z up.
 *
 * No device was at hand. Not known: which controllers have the watchdog that is set here (dhdSetWatchdog, 32 ms), and how long a call takes over USB.
 */
#include "watched.h"

enum {
    DHD_TIMEGUARD = 1,
    DHD_STATUS_FORCE = 5,
    DHD_STATUS_FORCEOFFCAUSE = 14,
    DHD_FORCEOFF_WATCHDOG = 3,
};
#define LONGEST 255 /* of the controller's watchdog: 0.125 ms each */

/* The functions of the vendor's library. Those from GetSystemName on may be missing. */
static struct {
    void *library;
    int (*Open)(void);
    int (*OpenID)(char);
    int (*Close)(char);
    int (*EnableForce)(unsigned char, char);
    int (*GetPosition)(double *, double *, double *, char);
    int (*GetOrientationFrame)(double[3][3], char);
    int (*GetLinearVelocity)(double *, double *, double *, char);
    int (*SetForceAndTorqueAndGripperForce)(double, double, double, double, double, double, double, char);
    const char *(*ErrorGetLastStr)(void);
    const char *(*GetSystemName)(char);
    bool (*HasWrist)(char);
    bool (*HasActiveWrist)(char);
    int (*GetAngularVelocityRad)(double *, double *, double *, char);
    unsigned (*GetButtonMask)(char);
    int (*GetStatus)(int *, char);
    int (*EnableExpertMode)(void);
    int (*DisableExpertMode)(void);
    int (*GetWatchdog)(unsigned char *, char);
    int (*SetWatchdog)(unsigned char, char);
} dhd;

struct device {
    struct watched watched;
    char id;
    bool has_wrist, turns;
    bool renders;        /* its forces were on at the last look */
    bool is_watched;     /* by its controller, too */
    unsigned char steps; /* of the controller's watchdog, as it was before */
    unsigned reads;
    struct limits limits;
};

static const char *last(void) { return dhd.ErrorGetLastStr ? dhd.ErrorGetLastStr() : NULL; }

/* A pointer to a function from dlsym's pointer to data, as POSIX has it. */
#define FIND(name, missing) (*(void **)&dhd.name = symbol(dhd.library, "dhd" #name, missing))

static int load(const char *path)
{
    const char *missing = NULL;
    if (loaded(&dhd.library, path, "Force Dimension's") != TAUT_DEVICE_OK)
        return TAUT_DEVICE_FAILED;
    FIND(OpenID, &missing);
    FIND(Open, &missing);
    FIND(Close, &missing);
    FIND(EnableForce, &missing);
    FIND(GetPosition, &missing);
    FIND(GetOrientationFrame, &missing);
    FIND(GetLinearVelocity, &missing);
    FIND(SetForceAndTorqueAndGripperForce, &missing);
    FIND(ErrorGetLastStr, &missing);
    FIND(GetSystemName, NULL);
    FIND(HasWrist, NULL);
    FIND(HasActiveWrist, NULL);
    FIND(GetAngularVelocityRad, NULL);
    FIND(GetButtonMask, NULL);
    FIND(GetStatus, NULL);
    FIND(EnableExpertMode, NULL);
    FIND(DisableExpertMode, NULL);
    FIND(GetWatchdog, NULL);
    FIND(SetWatchdog, NULL);
    return complete(&dhd.library, missing);
}

/* The wrench, back to x towards the user, y right, z up. */
static int push(const struct device *device, const double wrench[6])
{
    return dhd.SetForceAndTorqueAndGripperForce(-wrench[1], wrench[0], wrench[2], -wrench[4], wrench[3], wrench[5], 0, device->id);
}

/* How long the controller's firmware waits for a force before it ends the last one, 0.125 ms each; the vendor asks for expert mode. */
static bool watch_for(const struct device *device, unsigned char *before, unsigned char steps)
{
    bool watches = dhd.EnableExpertMode() >= 0 && dhd.GetWatchdog(before, device->id) >= 0 && dhd.SetWatchdog(steps, device->id) >= 0;
    return dhd.DisableExpertMode() >= 0 && watches;
}

/* Whether somebody or something has put its forces off: its button, its limit of speed, its watchdog. */
static bool is_off(const struct device *device)
{
    int status[32] = {0}; /* more than any version has */
    if (!dhd.GetStatus || dhd.GetStatus(status, device->id) < 0 || status[DHD_STATUS_FORCE] || !status[DHD_STATUS_FORCEOFFCAUSE])
        return false;
    /* This program stood still for longer: nobody has put them off. */
    if (status[DHD_STATUS_FORCEOFFCAUSE] == DHD_FORCEOFF_WATCHDOG && push(device, no_wrench) >= 0)
        dhd.EnableForce(1, device->id);
    return true;
}

static int32_t shut(void *opened)
{
    struct device *device = opened;
    unsigned char steps;
    int closed, zero = push(device, no_wrench);
    int off = dhd.EnableForce(0, device->id);
    if (device->is_watched)
        watch_for(device, &steps, device->steps);
    closed = dhd.Close(device->id);
    free(device);
    return zero < 0 || off < 0 || closed < 0 ? fail(TAUT_DEVICE_FAILED, "dhdClose", last()) : TAUT_DEVICE_OK;
}

static int32_t device_open(const char *options, void **opened)
{
    struct device wanted = {.limits = {5.0, 0.1, 1000.0, 0.5}}, *device;
    double wanted_id = -1;
    const char *library = "libdhd.so";
    const struct option known[] = {TEXT("library", &library), WHOLE("id", 0, 15, &wanted_id), WITH_TORQUE(wanted.limits), {0}};
    char copy[1024];
    int id, code;

    if ((code = read_options(options, copy, known)) != TAUT_DEVICE_OK || (code = load(library)) != TAUT_DEVICE_OK)
        return code;
    id = wanted_id < 0 ? dhd.Open() : dhd.OpenID((char)wanted_id);
    if (id < 0)
        return fail(TAUT_DEVICE_GONE, "no Force Dimension device can be opened", last());
    wanted.id = (char)id;
    wanted.has_wrist = dhd.HasWrist && dhd.HasWrist(wanted.id);
    wanted.turns = wanted.has_wrist && dhd.HasActiveWrist && dhd.HasActiveWrist(wanted.id);
    device = malloc(sizeof *device);
    if (!device) {
        dhd.Close(wanted.id);
        return fail(TAUT_DEVICE_FAILED, "dhdOpen", "no memory");
    }
    *device = wanted;
    /* So that a program that is gone leaves no force; the next program has what was set before. */
    if (dhd.EnableExpertMode && dhd.DisableExpertMode && dhd.GetWatchdog && dhd.SetWatchdog)
        device->is_watched = watch_for(device, &device->steps, LONGEST);
    if (push(device, no_wrench) < 0 || dhd.EnableForce(1, device->id) < 0) {
        code = fail(TAUT_DEVICE_FAILED, "dhdEnableForce", last());
        shut(device);
        return code;
    }
    return watched_from_now(device, opened);
}

static int32_t device_info(void *opened, taut_device_info *info)
{
    const struct device *device = opened;
    const char *name = dhd.GetSystemName ? dhd.GetSystemName(device->id) : NULL;
    char whole[64];
    snprintf(whole, sizeof whole, "Force Dimension %s", name ? name : "device");
    describe(info, whole, device->has_wrist ? 6 : 3, device->turns ? 6 : 3, &device->limits);
    return TAUT_DEVICE_OK;
}

/* From the vendor's axes to x right, y away from the user, z up. */
static void turned(const double from[3], double to[3])
{
    to[0] = from[1];
    to[1] = -from[0];
    to[2] = from[2];
}

static int32_t measure(void *opened, taut_device_sample *sample)
{
    struct device *device = opened;
    double p[3], v[3], w[3], frame[3][3];
    int result = dhd.GetPosition(&p[0], &p[1], &p[2], device->id);
    if (result < 0)
        return fail(TAUT_DEVICE_GONE, "dhdGetPosition", last());
    /* A look may cost a message: every 16 ms, after a pause, and until they are on. */
    if (device->reads++ % 16 == 0 || !device->renders || now() - device->watched.written > OLDEST)
        device->renders = !is_off(device);
    if (!device->renders)
        return fail(TAUT_DEVICE_NOT_READY, "no force", "its forces are off (its button, or too fast): put them on at the device");
    if (result == DHD_TIMEGUARD)
        return TAUT_DEVICE_NOTHING_NEW;
    if (dhd.GetLinearVelocity(&v[0], &v[1], &v[2], device->id) < 0)
        return fail(TAUT_DEVICE_GONE, "dhdGetLinearVelocity", last());
    turned(p, sample->position);
    turned(v, sample->velocity);
    if (device->has_wrist) {
        if (dhd.GetOrientationFrame(frame, device->id) < 0)
            return fail(TAUT_DEVICE_GONE, "dhdGetOrientationFrame", last());
        turned_rotation(frame, sample->orientation);
        if (dhd.GetAngularVelocityRad && dhd.GetAngularVelocityRad(&w[0], &w[1], &w[2], device->id) >= 0) {
            turned(w, sample->angular_velocity);
            sample->measured |= TAUT_DEVICE_HAS_ANGULAR_VELOCITY;
        }
    }
    sample->buttons = dhd.GetButtonMask ? dhd.GetButtonMask(device->id) & 0xffffu : 0;
    sample->age = 0;
    return TAUT_DEVICE_OK;
}

static int32_t render(void *opened, const double wrench[6])
{
    const struct device *device = opened;
    if (push(device, device->renders ? wrench : no_wrench) < 0)
        return fail(TAUT_DEVICE_GONE, "dhdSetForceAndTorqueAndGripperForce", last());
    return device->renders ? TAUT_DEVICE_OK : TAUT_DEVICE_NOT_READY;
}
