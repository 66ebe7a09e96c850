"""What a call costs: the whole call where the method has next to nothing to do, so the border's share is at most that."""

import time

import taut


def cost(call, calls=20_000):
    """Median over ten runs of the thread's CPU time per call, us."""
    runs = []
    for _ in range(10):
        before = time.thread_time()
        for _ in range(calls):
            call()
        runs.append((time.thread_time() - before) / calls * 1e6)
    return sorted(runs)[5]


sim = taut.Simulation("sphere-on-plane")
device = sim.start
device[2] += 0.1  # nothing is near
sim.update(device)
figures = {
    "update": cost(lambda: sim.update(device)),
    "force": cost(lambda: sim.force(0.0, device)),
    "force and its wrench": cost(lambda: sim.force(0.0, device).wrench),
    "god_object": cost(lambda: sim.god_object),
}
for name, microseconds in figures.items():
    print(f"{name}: {microseconds:.2f} us a call in free motion, the method's own work included")
