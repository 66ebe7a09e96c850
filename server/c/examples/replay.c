/* Replays a trace through a scene and prints the rows of `taut replay`: replay SCENE TRACE.csv
 *   cc -I ../include replay.c -L DIRECTORY -ltaut_c -o replay */
#include <stdio.h>
#include "taut.h"

static int fail(const char *what) {
    fprintf(stderr, "%s: %s\n", what, taut_last_error());
    return 1;
}

int main(int argc, char **argv) {
    if (argc != 3) {
        fprintf(stderr, "usage: %s SCENE TRACE.csv\n", argv[0]);
        return 2;
    }
    TautScene *scene;
    TautTrace *trace;
    if (taut_scene_load(argv[1], &scene) != TAUT_OK) return fail("scene");
    if (taut_trace_load(argv[2], &trace) != TAUT_OK) return fail("trace");
    puts(taut_replay_header());
    for (size_t i = 0; i < taut_trace_length(trace); i++) {
        double time;
        TautPose device;
        char row[1024];
        if (taut_trace_sample(trace, i, &time, &device) != TAUT_OK) return fail("sample");
        if (taut_replay_row(scene, time, &device, row, sizeof row, NULL) != TAUT_OK) return fail("row");
        puts(row);
    }
    taut_trace_free(trace);
    taut_scene_free(scene);
    return 0;
}
