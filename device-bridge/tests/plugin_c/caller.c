/* caller PLUGIN LIBRARY OPTIONS: reads and writes as taut does, and then hangs outside the plug-in. LIBRARY is the stand-in of the vendor's. */
#define _DEFAULT_SOURCE
#include <dlfcn.h>
#include <stdio.h>
#include <unistd.h>
#include "taut_device.h"

/* A minute: only a hang takes this long. */
#define UNTIL(condition) \
    for (waited = 0; !(condition); waited++, usleep(1000)) \
        if (waited > 60000) \
            return fprintf(stderr, "never so: %s\n", #condition), 1

int main(int count, char **given)
{
    const double wrench[6] = {0, 0, 1, 0.1, 0, 0};
    taut_device_sample sample;
    void *plugin, *library, *device, *symbol;
    const taut_device_table *(*entry)(void);
    const taut_device_table *table;
    const _Atomic long long *force, *torque;
    int waited, first;

    if (count != 4 || !(plugin = dlopen(given[1], RTLD_NOW)) || !(library = dlopen(given[2], RTLD_NOW)))
        return fprintf(stderr, "%s\n", dlerror()), 1;
    *(void **)&entry = symbol = dlsym(plugin, "taut_device_entry");
    force = dlsym(library, "taut_test_force");
    torque = dlsym(library, "taut_test_torque");
    if (!symbol || !force || !torque)
        return fprintf(stderr, "%s\n", dlerror()), 1;
    table = entry();
    UNTIL(table->open(given[3], &device) == TAUT_DEVICE_OK);
    UNTIL((table->read(device, &sample), table->write(device, wrench), *force == 1000000));
    UNTIL(*force == 0 && *torque == 0);
    printf("let go of after %d ms\n", waited);
    /* What comes next was made for a hand that felt the last. */
    first = table->write(device, wrench);
    if (first != TAUT_DEVICE_NOTHING_NEW || *force != 0)
        return fprintf(stderr, "%d, and %lld uN\n", first, *force), 1;
    UNTIL((table->read(device, &sample), table->write(device, wrench), *force == 1000000));
    if (table->close(device) != TAUT_DEVICE_OK || *force != 0)
        return fprintf(stderr, "%lld uN after the end\n", *force), 1;
    return 0;
}
