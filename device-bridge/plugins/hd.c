/*
 * 3D Systems' devices (Touch, Touch X, Phantom) as a plug-in of taut, by OpenHaptics' device library (HD), which is loaded at run time.
 *
 *   cc -std=c11 -O2 -shared -fPIC -I include -o taut_hd.so plugins/hd.c -ldl -lm -lpthread
 *   taut bridge --device plugin:/path/taut_hd.so,library=/usr/lib/libHD.so,force=1,...
 *
 * Options: library (default libHD.so), name (of the device in the vendor's configuration, default its first), force (N, 1), stiffness (N/m, 300): what the
 * device renders, from its data sheet. The defaults are small on purpose.
 *
 * The library has a servo thread of its own, 1 kHz: reading and writing happen in its callback, between hdBeginFrame and hdEndFrame. A force that is older than
 * 20 ms there is zero, whatever the rest of the program does. Six degrees of freedom are sensed, three rendered: torques at the gimbal are not.
 *
 * Names, order of arguments, numbers and units are those of the published header (hdDefines.h 3.0) and of public programs that use it: mm, mm/s, N; a transform
 * is 16 numbers, column by column. Axes there: x right, y up, z towards the user. Here: x right, y away, z up.
 *
 * No device was at hand, and not the vendor's library.
 */
#include "vendor.h"

enum {
    HD_CURRENT_BUTTONS = 0x2000,
    HD_CURRENT_VELOCITY = 0x2051,
    HD_CURRENT_TRANSFORM = 0x2052,
    HD_DEVICE_MODEL_TYPE = 0x2501,
    HD_CALIBRATION_STYLE = 0x2555,
    HD_CURRENT_FORCE = 0x2700,
    HD_FORCE_OUTPUT = 0x4000,
    HD_CALIBRATION_NEEDS_UPDATE = 0x5001,
    HD_CALIBRATION_NEEDS_MANUAL_INPUT = 0x5002,
    HD_CALIBRATION_AUTO = 2, HD_CALIBRATION_INKWELL = 4, /* a bit each */
    HD_CALLBACK_DONE = 0,
    HD_CALLBACK_CONTINUE = 1,
    HD_DEFAULT_PRIORITY = 32767,
    /* Errors below are none, above those of a force that was too large or motors that are warm: the library limits them itself. */
    HD_FIRST_FORCE_ERROR = 0x0200,
    HD_FORCE_ERROR = 0x0204,
};
#define HD_INVALID_HANDLE 0xffffffffu

typedef struct {
    unsigned code;
    int internal;
    unsigned device;
} hd_error;

/* The functions of the vendor's library. The last three may be missing. */
static struct {
    void *library;
    unsigned (*InitDevice)(const char *);
    void (*DisableDevice)(unsigned);
    void (*BeginFrame)(unsigned);
    void (*EndFrame)(unsigned);
    void (*Enable)(unsigned);
    void (*GetDoublev)(unsigned, double *);
    void (*GetIntegerv)(unsigned, int *);
    void (*SetDoublev)(unsigned, const double *);
    hd_error (*GetError)(void);
    const char *(*GetErrorString)(unsigned);
    unsigned long (*ScheduleAsynchronous)(unsigned (*)(void *), void *, unsigned short);
    void (*StartScheduler)(void);
    void (*StopScheduler)(void);
    void (*Unschedule)(unsigned long);
    const char *(*GetString)(unsigned);
    unsigned (*CheckCalibration)(void);
    void (*UpdateCalibration)(unsigned);
} hd;

struct device {
    unsigned handle;
    unsigned long callback;
    struct limits limits;
    char name[64];
    /* What the servo thread and this one share; held for the copying of some numbers. */
    pthread_mutex_t lock;
    double transform[16], velocity[3], seen; /* seen: when, s */
    int buttons;
    bool uncalibrated, closing, closed;
    unsigned error;
    unsigned long long frames, taken;
    double wanted[3], written; /* N in the vendor's axes; when, s */
    bool let_go;               /* the servo thread has rendered none since the last write */
};

/* A pointer to a function from dlsym's pointer to data, as POSIX has it. */
#define FIND(name, missing) (*(void **)&hd.name = symbol(hd.library, "hd" #name, missing))

static int load(const char *path)
{
    const char *missing = NULL;
    if (loaded(&hd.library, path, "OpenHaptics'") != TAUT_DEVICE_OK)
        return TAUT_DEVICE_FAILED;
    FIND(InitDevice, &missing);
    FIND(DisableDevice, &missing);
    FIND(BeginFrame, &missing);
    FIND(EndFrame, &missing);
    FIND(Enable, &missing);
    FIND(GetDoublev, &missing);
    FIND(GetIntegerv, &missing);
    FIND(SetDoublev, &missing);
    FIND(GetError, &missing);
    FIND(GetErrorString, &missing);
    FIND(ScheduleAsynchronous, &missing);
    FIND(StartScheduler, &missing);
    FIND(StopScheduler, &missing);
    FIND(Unschedule, &missing);
    FIND(GetString, NULL);
    FIND(CheckCalibration, NULL);
    FIND(UpdateCalibration, NULL);
    return complete(&hd.library, missing);
}

/* The newest error that ends a session; 0 for none. The library keeps them, newest first: a force that was too large may lie on one that ends it. */
static unsigned failed(void)
{
    for (int left = 64; left > 0; left--) {
        unsigned code = hd.GetError().code;
        if (code < HD_FIRST_FORCE_ERROR || code >= HD_FORCE_ERROR)
            return code;
    }
    return 0;
}

/* Whether the device asks for its inkwell. What it has found out since is taken over: until then its poses are those of before. */
static bool asks_for_inkwell(void)
{
    unsigned state = hd.CheckCalibration ? hd.CheckCalibration() : 0;
    int styles = 0;
    if (state == HD_CALIBRATION_NEEDS_UPDATE && hd.UpdateCalibration) {
        hd.GetIntegerv(HD_CALIBRATION_STYLE, &styles);
        styles &= HD_CALIBRATION_AUTO | HD_CALIBRATION_INKWELL;
        if (styles)
            hd.UpdateCalibration(styles & HD_CALIBRATION_AUTO ? HD_CALIBRATION_AUTO : HD_CALIBRATION_INKWELL);
    }
    return state == HD_CALIBRATION_NEEDS_MANUAL_INPUT;
}

/* A millisecond of the vendor's servo thread. */
static unsigned servo(void *shared)
{
    struct device *device = shared;
    double transform[16], velocity[3], force[3] = {0, 0, 0};
    int buttons = 0;
    bool uncalibrated, closing;
    unsigned error;

    uncalibrated = asks_for_inkwell();
    hd.BeginFrame(device->handle);
    for (int i = 0; i < 16; i++)
        transform[i] = NAN; /* what is not set is no pose */
    hd.GetDoublev(HD_CURRENT_TRANSFORM, transform);
    hd.GetDoublev(HD_CURRENT_VELOCITY, velocity);
    hd.GetIntegerv(HD_CURRENT_BUTTONS, &buttons);
    pthread_mutex_lock(&device->lock);
    closing = device->closing;
    if (!closing && !uncalibrated && now() - device->written <= OLDEST)
        memcpy(force, device->wanted, sizeof force);
    else
        device->let_go = true;
    pthread_mutex_unlock(&device->lock);
    hd.SetDoublev(HD_CURRENT_FORCE, force);
    hd.EndFrame(device->handle);
    error = failed();

    pthread_mutex_lock(&device->lock);
    memcpy(device->transform, transform, sizeof transform);
    memcpy(device->velocity, velocity, sizeof velocity);
    device->buttons = buttons;
    device->uncalibrated = uncalibrated;
    device->error = error ? error : device->error;
    device->seen = now();
    device->frames++;
    device->closed = closing;
    pthread_mutex_unlock(&device->lock);
    return closing ? HD_CALLBACK_DONE : HD_CALLBACK_CONTINUE;
}

static int32_t device_close(void *opened)
{
    struct device *device = opened;
    double begun = now();
    bool closed = false;
    /* The servo thread writes the zero; one that stands still does not, and its stop is all there is. */
    while (!closed && now() - begun < 0.1) {
        struct timespec wait = {0, 1000000};
        pthread_mutex_lock(&device->lock);
        device->closing = true;
        closed = device->closed;
        pthread_mutex_unlock(&device->lock);
        nanosleep(&wait, NULL);
    }
    hd.StopScheduler();
    hd.Unschedule(device->callback);
    hd.DisableDevice(device->handle);
    if (!closed) /* it may come back: what it uses stays */
        return fail(TAUT_DEVICE_FAILED, "hdStopScheduler", "the servo thread stood still: nobody could write the zero");
    pthread_mutex_destroy(&device->lock);
    free(device);
    return TAUT_DEVICE_OK;
}

static int32_t device_open(const char *options, void **opened)
{
    struct device *device;
    struct limits limits = {.force = 1.0, .stiffness = 300.0};
    const char *library = "libHD.so", *name = NULL, *model;
    const struct option known[] = {
        TEXT("library", &library), TEXT("name", &name), NUMBER("force", 0.1, 40, &limits.force), NUMBER("stiffness", 1, 1e4, &limits.stiffness), {0},
    };
    char copy[1024];
    unsigned error;
    int code;

    if ((code = read_options(options, copy, known)) != TAUT_DEVICE_OK || (code = load(library)) != TAUT_DEVICE_OK)
        return code;
    device = calloc(1, sizeof *device);
    if (!device || pthread_mutex_init(&device->lock, NULL)) {
        free(device);
        return fail(TAUT_DEVICE_FAILED, "hdInitDevice", "no memory");
    }
    device->limits = limits;
    device->handle = hd.InitDevice(name);
    error = failed();
    if (device->handle == HD_INVALID_HANDLE || error) {
        free(device);
        return fail(TAUT_DEVICE_GONE, "no device of 3D Systems can be opened (is it set up with the vendor's tool, under that name?)", hd.GetErrorString(error));
    }
    model = hd.GetString ? hd.GetString(HD_DEVICE_MODEL_TYPE) : NULL;
    snprintf(device->name, sizeof device->name, "3D Systems %s", model ? model : "device");
    hd.Enable(HD_FORCE_OUTPUT);
    device->written = now() - 1;
    device->seen = now();
    device->callback = hd.ScheduleAsynchronous(servo, device, HD_DEFAULT_PRIORITY);
    hd.StartScheduler();
    if ((error = failed())) {
        code = fail(TAUT_DEVICE_FAILED, "hdStartScheduler", hd.GetErrorString(error));
        device_close(device);
        return code;
    }
    *opened = device;
    return TAUT_DEVICE_OK;
}

static int32_t device_info(void *opened, taut_device_info *info)
{
    const struct device *device = opened;
    describe(info, device->name, 6, 3, &device->limits);
    return TAUT_DEVICE_OK;
}

/* From the vendor's axes to x right, y away from the user, z up. */
static void turned(const double from[3], double to[3])
{
    to[0] = from[0];
    to[1] = -from[2];
    to[2] = from[1];
}

static int32_t device_read(void *opened, taut_device_sample *sample)
{
    struct device *device = opened;
    double transform[16], velocity[3], p[3], frame[3][3];
    bool uncalibrated, is_new;
    unsigned error;

    pthread_mutex_lock(&device->lock);
    memcpy(transform, device->transform, sizeof transform);
    memcpy(velocity, device->velocity, sizeof velocity);
    sample->buttons = (uint32_t)device->buttons & 0xffffu;
    sample->age = now() - device->seen;
    uncalibrated = device->uncalibrated;
    error = device->error;
    is_new = device->frames != device->taken;
    device->taken = device->frames;
    pthread_mutex_unlock(&device->lock);
    if (error)
        return fail(TAUT_DEVICE_GONE, "the device", hd.GetErrorString(error));
    if (!is_new || sample->age > OLDEST)
        return TAUT_DEVICE_NOTHING_NEW;
    if (uncalibrated)
        return fail(TAUT_DEVICE_NOT_READY, "not calibrated", "put the stylus into its inkwell");
    for (int i = 0; i < 3; i++) {
        p[i] = transform[12 + i] * 1e-3;
        velocity[i] *= 1e-3;
    }
    turned(p, sample->position);
    turned(velocity, sample->velocity);
    /* `transform` holds column after column. */
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 3; column++)
            frame[row][column] = transform[4 * column + row];
    turned_rotation(frame, sample->orientation);
    return TAUT_DEVICE_OK;
}

static int32_t device_write(void *opened, const double wrench[6])
{
    struct device *device = opened;
    const double none[6] = {0};
    bool let_go;
    pthread_mutex_lock(&device->lock);
    /* Made for a hand that feels the last one, and it feels none: the next begins there. */
    let_go = device->let_go;
    device->let_go = false;
    if (let_go)
        wrench = none;
    /* Back to x right, y up, z towards the user. */
    device->wanted[0] = wrench[0];
    device->wanted[1] = wrench[2];
    device->wanted[2] = -wrench[1];
    device->written = now();
    pthread_mutex_unlock(&device->lock);
    return let_go ? TAUT_DEVICE_NOTHING_NEW : TAUT_DEVICE_OK;
}
