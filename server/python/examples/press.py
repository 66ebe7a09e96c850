# %% [markdown]
# A peg is replayed over the edge of its hole: force over time. Cells as Jupyter and editors know them.
# %%
import sys
import numpy as np
import taut
# %%
trace = sys.argv[1]  # a trace at 100 Hz or more: t,x,y,z,qw,qx,qy,qz
rows = taut.replay("peg-in-a-hole", trace)
column = {name: rows[:, i] for i, name in enumerate(taut.COLUMNS)}
# %%
force = np.linalg.norm([column["fx"], column["fy"], column["fz"]], axis=0)
print(f"{len(rows)} rows, most force {force.max():.2f} N, smallest gap {column['gap_min'].min() * 1e6:.2f} um")
