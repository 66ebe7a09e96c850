/*
 * For a vendor's library without a thread of its own: a second thread takes away a force that no other has followed within OLDEST, and goes on to do so
 * every 5 ms, so that the controller hears of somebody. The caller may stand still outside the library, where the system does not run it.
 *
 * Both call the library with `calls` held: it never has two of them within. A thread that hangs within the library keeps it, and then nobody can write.
 * Neither vendor's library asks for one thread: Force Dimension's error is the calling thread's and its example has a thread for each device, and Haption's
 * calls back in a thread of its own, from which published programs set the force while others close.
 */
#ifndef TAUT_WATCHED_H
#define TAUT_WATCHED_H

#include "vendor.h"

/* The first of struct device. */
struct watched {
    pthread_mutex_t calls;
    pthread_t thread;
    double written; /* by the caller: when, s */
    bool ends;
};

/* A plug-in's own: read, write and close without another thread. */
static int32_t measure(void *opened, taut_device_sample *sample);
static int32_t render(void *opened, const double wrench[6]);
static int32_t shut(void *opened);

static const double no_wrench[6];

static void *watch(void *opened)
{
    struct watched *watched = opened;
    const struct timespec look = {0, 5000000};
    for (bool ends = false; !ends;) {
        pthread_mutex_lock(&watched->calls);
        ends = watched->ends;
        if (!ends && now() - watched->written > OLDEST)
            render(opened, no_wrench);
        pthread_mutex_unlock(&watched->calls);
        nanosleep(&look, NULL);
    }
    return NULL;
}

/* The end of open; closes what cannot be watched. */
static int watched_from_now(void *device, void **opened)
{
    struct watched *watched = device;
    pthread_mutexattr_t lends; /* its priority to the thread that holds it */
    int failed;
    pthread_mutexattr_init(&lends);
    pthread_mutexattr_setprotocol(&lends, PTHREAD_PRIO_INHERIT);
    watched->ends = false;
    watched->written = now();
    failed = pthread_mutex_init(&watched->calls, &lends) || pthread_create(&watched->thread, NULL, watch, device);
    pthread_mutexattr_destroy(&lends);
    if (failed) {
        shut(device);
        return fail(TAUT_DEVICE_FAILED, "the thread that watches", "the system has none");
    }
    *opened = device;
    return TAUT_DEVICE_OK;
}

static int32_t device_read(void *opened, taut_device_sample *sample)
{
    struct watched *watched = opened;
    int32_t answer;
    pthread_mutex_lock(&watched->calls);
    answer = measure(opened, sample);
    pthread_mutex_unlock(&watched->calls);
    return answer;
}

static int32_t device_write(void *opened, const double wrench[6])
{
    struct watched *watched = opened;
    int32_t answer;
    bool late;
    pthread_mutex_lock(&watched->calls);
    /* Made for a hand that feels the last one, and it feels none: the next begins there. */
    late = now() - watched->written > OLDEST;
    answer = render(opened, late ? no_wrench : wrench);
    watched->written = now();
    pthread_mutex_unlock(&watched->calls);
    return late && answer == TAUT_DEVICE_OK ? TAUT_DEVICE_NOTHING_NEW : answer;
}

static int32_t device_close(void *opened)
{
    struct watched *watched = opened;
    pthread_mutex_lock(&watched->calls);
    watched->ends = true;
    pthread_mutex_unlock(&watched->calls);
    pthread_join(watched->thread, NULL);
    pthread_mutex_destroy(&watched->calls);
    return shut(opened);
}

#endif
