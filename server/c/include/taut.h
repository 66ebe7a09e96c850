/* The god-object method for programs in C. Made by cbindgen from server/c/src; to make it again: TAUT_WRITE_HEADER=1 cargo test -p taut-c --test all header::
 * Poses are world from body, SI units, quaternions w x y z. One thread at a time uses a scene. docs/c.md says more. */

#ifndef TAUT_H
#define TAUT_H

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

/*
 How a call ended.
 */
typedef enum TautStatus {
  /*
   It did what it says.
   */
  TAUT_OK = 0,
  /*
   An argument is NULL, not finite or out of range.
   */
  TAUT_BAD_ARGUMENT = 1,
  /*
   A file cannot be read, or something is wrong in it.
   */
  TAUT_BAD_FILE = 2,
  /*
   A buffer is too short; the length that is needed was written.
   */
  TAUT_SHORT_BUFFER = 3,
  /*
   Another thread is in a call with the same handle.
   */
  TAUT_BUSY = 4,
  /*
   A fault of the library. The handle answers `TAUT_PANIC` until it is reset or freed.
   */
  TAUT_PANIC = 5,
} TautStatus;

/*
 A scene that is stepped. One thread at a time may use it; a second one is answered `TAUT_BUSY`.
 */
typedef struct TautScene TautScene;

/*
 A recorded motion of the device.
 */
typedef struct TautTrace TautTrace;

/*
 A pose: world from body.
 */
typedef struct TautPose {
  /*
   x, y, z of the body's own origin, m.
   */
  double position[3];
  /*
   w, x, y, z of a unit quaternion.
   */
  double rotation[4];
} TautPose;

/*
 What a scene is.
 */
typedef struct TautSceneInfo {
  /*
   Where the god-object starts.
   */
  struct TautPose start;
  /*
   Point at which wrenches act, in the god-object's own frame, m.
   */
  double reference_point[3];
  /*
   Mass of the god-object, kg.
   */
  double mass;
  /*
   Stiffness of the coupling at the reference point, N/m.
   */
  double stiffness;
  /*
   Longest side of the box around the god-object, m.
   */
  double size;
  /*
   Number of obstacles.
   */
  size_t obstacles;
} TautSceneInfo;

/*
 What one update of the god-object did.
 */
typedef struct TautUpdate {
  /*
   Smallest distance between the bodies, m; infinite when none is near.
   */
  double gap_min;
  /*
   Worst relative KKT residual of the update's projections.
   */
  double kkt;
  /*
   Rows in the constraint set.
   */
  size_t contacts;
  /*
   Rows in the active set.
   */
  size_t active;
  /*
   Repetitions of project, move, collect.
   */
  uint32_t substeps;
  /*
   Projections without an answer; the body stayed where it was.
   */
  uint32_t solver_failures;
  /*
   Obstacles that did not get to their targets.
   */
  uint32_t obstacles_blocked;
  /*
   The budget ran out before the body was as close as it gets: safe, only not yet closest.
   */
  bool unfinished;
} TautUpdate;

/*
 The force on the hand.
 */
typedef struct TautForce {
  /*
   N, world axes, within the scene's limits.
   */
  double force[3];
  /*
   Torque about the reference point, N m, world axes, within the scene's limits.
   */
  double torque[3];
  /*
   Relative KKT residual of the projection.
   */
  double kkt;
  /*
   Rows in the active set.
   */
  size_t active;
  /*
   The answer is certified. Where it is not, force and torque are zero, but between obstacles that move.
   */
  bool solved;
  /*
   A limit of force or torque was at work.
   */
  bool saturated;
} TautForce;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/*
 The sentence of the last call of this thread that failed; empty before the first. Valid until the next call of this thread fails.
 */
const char *taut_last_error(void);

/*
 The library's version.
 */
const char *taut_version(void);

/*
 Loads a shipped scene by its name (`peg-in-a-hole`, ...), or a scene file by its path. Free it with `taut_scene_free`.

 # Safety
 `name_or_path` is a string that ends with a zero byte; `scene` is valid for a write. Both may be NULL, and are refused.
 */
enum TautStatus taut_scene_load(const char *name_or_path,
                                struct TautScene **scene);

/*
 Gives a scene back; NULL is nothing. No other thread may be in a call with it.

 # Safety
 `scene` is NULL or of `taut_scene_load`, and is used no more.
 */
void taut_scene_free(struct TautScene *scene);

/*
 What a scene is.

 # Safety
 `scene` is NULL or a scene; `info` is NULL or valid for a write.
 */
enum TautStatus taut_scene_info(const struct TautScene *scene, struct TautSceneInfo *info);

/*
 Back to the start, as if nothing had been stepped. Allocates memory: not for a real-time loop.

 # Safety
 `scene` is NULL or a scene.
 */
enum TautStatus taut_scene_reset(struct TautScene *scene);

/*
 Loop 1: the god-object follows the device as far as the obstacles let it, and never further. `god_object` gets its pose; `update`
 gets what was done, and may be NULL.

 # Safety
 `scene` is NULL or a scene; the others are NULL or valid.
 */
enum TautStatus taut_god_object_update(struct TautScene *scene,
                                       const struct TautPose *device,
                                       struct TautPose *god_object,
                                       struct TautUpdate *update);

/*
 Loop 2: the force for a device pose on the newest constraint set. `time`, s, never runs back; once per reading of the device.

 # Safety
 `scene` is NULL or a scene; the others are NULL or valid.
 */
enum TautStatus taut_coupling_step(struct TautScene *scene,
                                   double time,
                                   const struct TautPose *device,
                                   struct TautForce *force);

/*
 Sends an obstacle (counted from 0, in the scene file's order) somewhere: it goes there at the next update of the god-object.

 # Safety
 `scene` is NULL or a scene; `target` is NULL or valid.
 */
enum TautStatus taut_obstacle_move(struct TautScene *scene,
                                   size_t obstacle,
                                   const struct TautPose *target);

/*
 Where an obstacle is.

 # Safety
 `scene` is NULL or a scene; `pose` is NULL or valid for a write.
 */
enum TautStatus taut_obstacle_pose(const struct TautScene *scene,
                                   size_t obstacle,
                                   struct TautPose *pose);

/*
 The names of the columns of `taut_replay_row`, without an end of line.
 */
const char *taut_replay_header(void);

/*
 Moves the scene's obstacles, updates the god-object, computes the force, and writes the row that `taut replay` writes, without an
 end of line. 1024 bytes are always enough. Where the buffer is too short, the row was computed and is lost.

 # Safety
 `scene` is NULL or a scene; `device` is NULL or valid; `buffer` is NULL or valid for `length` bytes, `needed` is NULL or valid.
 */
enum TautStatus taut_replay_row(struct TautScene *scene,
                                double time,
                                const struct TautPose *device,
                                char *buffer,
                                size_t length,
                                size_t *needed);

/*
 Looks at a file (mesh, scene, trace or workbench) as `taut check` does, and writes what was found, as text. `good` gets whether
 nothing is wrong. A file that is bad, or missing, is an answer, no error.

 # Safety
 `path` is NULL or a string that ends with a zero byte; `buffer` is NULL or valid for `length` bytes, the others are NULL or valid.
 */
enum TautStatus taut_check(const char *path,
                           bool *good,
                           char *buffer,
                           size_t length,
                           size_t *needed);

/*
 Reads a trace: CSV with the columns t, x, y, z, qw, qx, qy, qz. Free it with `taut_trace_free`.

 # Safety
 `path` is NULL or a string that ends with a zero byte; `trace` is NULL or valid for a write.
 */
enum TautStatus taut_trace_load(const char *path, struct TautTrace **trace);

/*
 Number of samples; 0 for NULL.

 # Safety
 `trace` is NULL or a trace.
 */
size_t taut_trace_length(const struct TautTrace *trace);

/*
 One sample, counted from 0: its time, s, and the device's pose.

 # Safety
 `trace` is NULL or a trace; the others are NULL or valid for a write.
 */
enum TautStatus taut_trace_sample(const struct TautTrace *trace,
                                  size_t index,
                                  double *time,
                                  struct TautPose *device);

/*
 Gives a trace back; NULL is nothing.

 # Safety
 `trace` is NULL or of `taut_trace_load`, and is used no more.
 */
void taut_trace_free(struct TautTrace *trace);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* TAUT_H */
