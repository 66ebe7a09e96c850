/*
 * Haption's devices (Virtuose) as a plug-in of taut, by the vendor's own library, which is loaded at run time.
 *
 *   cc -std=c11 -O2 -shared -fPIC -I include -o taut_virtuose.so plugins/virtuose.c -ldl -lm -lpthread
 *   taut bridge --device plugin:/path/taut_virtuose.so,library=/path/libVirtuoseAPI.so,host=192.168.1.13,force=5,...
 *
 * Options: library (default libVirtuoseAPI.so), host (of the controller as virtOpen takes it, default 127.0.0.1#53210), force (N, 5), torque (N m, 0.3),
 * stiffness (N/m, 500), rotational-stiffness (N m/rad, 1): what the device renders, from its data sheet. The defaults are small on purpose.
 *
 * Names, order of arguments, numbers and units are those of the published header (VirtuoseAPI.h 4.04) and of public programs that use it: m, m/s, rad/s, N,
 * N m, s, all of them float; a pose is x y z qx qy qz qw; results other than 0 are errors. Axes there: x towards the user, y right, z up. Here: x right,
 * y away, z up.
 *
 * Pose and speed are those of the control point in the environment's frame, as the force is. The physical ones of the handle are in the base's, which is
 * another one once the handle was turned while it indexed, and it indexes whenever it is let go: a force would point elsewhere. While the offset button is
 * pressed, the power is off or nobody holds the handle, the device renders no force: then it is not ready.
 *
 * No device was at hand, and not the vendor's library. Where the whole program is gone, the vendor's watchdog is said to let go after 2 s only.
 */
#include "watched.h"

enum {
    COMMAND_TYPE_IMPEDANCE = 3,
    INDEXING_ALL_FORCE_FEEDBACK_INHIBITION = 3,
};
#define STEP 0.001f /* s, from one call to the next */

/* The functions of the vendor's library. */
static struct {
    void *library;
    void *(*Open)(const char *);
    int (*Close)(void *);
    int (*SetIndexingMode)(void *, int);
    int (*SetForceFactor)(void *, float);
    int (*SetSpeedFactor)(void *, float);
    int (*SetTimeStep)(void *, float);
    int (*SetBaseFrame)(void *, float *);
    int (*SetObservationFrame)(void *, float *);
    int (*SetCommandType)(void *, int);
    int (*SetPowerOn)(void *, int);
    int (*GetPowerOn)(void *, int *);
    int (*IsInShiftPosition)(void *, int *);
    int (*GetPosition)(void *, float *);
    int (*GetSpeed)(void *, float *);
    int (*GetButton)(void *, int, int *);
    int (*SetForce)(void *, float *);
    int (*GetErrorCode)(void *);
    const char *(*GetErrorMessage)(int);
} virt;

struct device {
    struct watched watched;
    void *context;
    bool renders; /* power, and no indexing, at the last reading */
    struct limits limits;
};

/* What went wrong last; of opening with NULL. */
static const char *last(void *context) { return virt.GetErrorMessage(virt.GetErrorCode(context)); }

/* A pointer to a function from dlsym's pointer to data, as POSIX has it. */
#define FIND(name) (*(void **)&virt.name = symbol(virt.library, "virt" #name, &missing))

static int load(const char *path)
{
    const char *missing = NULL;
    if (loaded(&virt.library, path, "Haption's") != TAUT_DEVICE_OK)
        return TAUT_DEVICE_FAILED;
    FIND(Open);
    FIND(Close);
    FIND(SetIndexingMode);
    FIND(SetForceFactor);
    FIND(SetSpeedFactor);
    FIND(SetTimeStep);
    FIND(SetBaseFrame);
    FIND(SetObservationFrame);
    FIND(SetCommandType);
    FIND(SetPowerOn);
    FIND(GetPowerOn);
    FIND(IsInShiftPosition);
    FIND(GetPosition);
    FIND(GetSpeed);
    FIND(GetButton);
    FIND(SetForce);
    FIND(GetErrorCode);
    FIND(GetErrorMessage);
    return complete(&virt.library, missing);
}

/* Each is tried, whatever became of the one before. */
static int32_t shut(void *opened)
{
    struct device *device = opened;
    float none[6] = {0};
    int zero = virt.SetForce(device->context, none);
    int off = virt.SetPowerOn(device->context, 0);
    int code = zero || off ? fail(TAUT_DEVICE_FAILED, "virtSetPowerOn", last(device->context)) : TAUT_DEVICE_OK;
    if (virt.Close(device->context))
        code = fail(TAUT_DEVICE_FAILED, "virtClose", last(NULL));
    free(device);
    return code;
}

/* Factors, time step and frames come before the type of command, as the vendor asks; the force is zero before there is power. Returns what failed. */
static const char *prepared(void *context)
{
    float here[7] = {0, 0, 0, 0, 0, 0, 1}, none[6] = {0};
    if (virt.SetIndexingMode(context, INDEXING_ALL_FORCE_FEEDBACK_INHIBITION))
        return "virtSetIndexingMode";
    if (virt.SetForceFactor(context, 1) || virt.SetSpeedFactor(context, 1))
        return "virtSetForceFactor, virtSetSpeedFactor";
    if (virt.SetTimeStep(context, STEP))
        return "virtSetTimeStep";
    if (virt.SetBaseFrame(context, here) || virt.SetObservationFrame(context, here))
        return "virtSetBaseFrame, virtSetObservationFrame";
    if (virt.SetCommandType(context, COMMAND_TYPE_IMPEDANCE))
        return "virtSetCommandType";
    if (virt.SetForce(context, none))
        return "virtSetForce";
    return virt.SetPowerOn(context, 1) ? "virtSetPowerOn" : NULL;
}

static int32_t device_open(const char *options, void **opened)
{
    struct device wanted = {.limits = {5.0, 0.3, 500.0, 1.0}}, *device;
    const char *library = "libVirtuoseAPI.so", *host = "127.0.0.1#53210", *failed;
    const struct option known[] = {TEXT("library", &library), TEXT("host", &host), WITH_TORQUE(wanted.limits), {0}};
    char copy[1024];
    int code;

    if ((code = read_options(options, copy, known)) != TAUT_DEVICE_OK || (code = load(library)) != TAUT_DEVICE_OK)
        return code;
    device = malloc(sizeof *device);
    if (!device)
        return fail(TAUT_DEVICE_FAILED, "virtOpen", "no memory");
    *device = wanted;
    device->context = virt.Open(host);
    if (!device->context) {
        free(device);
        return fail(TAUT_DEVICE_GONE, "no Virtuose answers there (option host=ADDRESS)", last(NULL));
    }
    if ((failed = prepared(device->context))) {
        char why[128];
        snprintf(why, sizeof why, "%s", last(device->context));
        shut(device);
        return fail(TAUT_DEVICE_FAILED, failed, why);
    }
    return watched_from_now(device, opened);
}

static int32_t device_info(void *opened, taut_device_info *info)
{
    const struct device *device = opened;
    describe(info, "Haption Virtuose", 6, 6, &device->limits);
    return TAUT_DEVICE_OK;
}

/* From the vendor's axes to x right, y away from the user, z up. */
static void turned(const double from[3], double to[3])
{
    to[0] = from[1];
    to[1] = -from[0];
    to[2] = from[2];
}

static void turned_float(const float from[3], double to[3])
{
    const double seen[3] = {from[0], from[1], from[2]};
    turned(seen, to);
}

static int32_t measure(void *opened, taut_device_sample *sample)
{
    struct device *device = opened;
    float pose[7], speed[6];
    int power = 0, indexes = 1, pressed;

    device->renders = false;
    if (virt.GetPosition(device->context, pose))
        return fail(TAUT_DEVICE_GONE, "virtGetPosition", last(device->context));
    if (virt.GetSpeed(device->context, speed))
        return fail(TAUT_DEVICE_GONE, "virtGetSpeed", last(device->context));
    if (virt.GetPowerOn(device->context, &power) || virt.IsInShiftPosition(device->context, &indexes))
        return fail(TAUT_DEVICE_GONE, "virtGetPowerOn, virtIsInShiftPosition", last(device->context));
    if (!power || indexes)
        return fail(TAUT_DEVICE_NOT_READY, "no force", power ? "it indexes: let the offset button go and hold the handle" : "its power is off");
    device->renders = true;
    turned_float(pose, sample->position);
    turned_float(speed, sample->velocity);
    turned_float(speed + 3, sample->angular_velocity);
    sample->measured |= TAUT_DEVICE_HAS_ANGULAR_VELOCITY;
    sample->orientation[0] = pose[6];
    turned_float(pose + 3, sample->orientation + 1);
    /* A model without one of them has it never pressed. */
    sample->buttons = 0;
    for (int button = 0; button < 2; button++)
        if (!virt.GetButton(device->context, button + 1, &pressed) && pressed)
            sample->buttons |= 1u << button;
    sample->age = 0;
    return TAUT_DEVICE_OK;
}

static int32_t render(void *opened, const double wrench[6])
{
    const struct device *device = opened;
    float sent[6] = {0};
    if (device->renders)
        for (int i = 0; i < 6; i += 3) {
            /* Back to x towards the user, y right, z up. */
            sent[i] = (float)-wrench[i + 1];
            sent[i + 1] = (float)wrench[i];
            sent[i + 2] = (float)wrench[i + 2];
        }
    if (virt.SetForce(device->context, sent))
        return fail(TAUT_DEVICE_GONE, "virtSetForce", last(device->context));
    return device->renders ? TAUT_DEVICE_OK : TAUT_DEVICE_NOT_READY;
}
