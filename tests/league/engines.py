"""The engines, each with the same convex pieces, the same mesh and the same spring to the hand.

A dynamics engine gets a light body (`mass`; its inertia is mass * radius^2) that a spring of 1000 N/m, damped against the hand's own
velocity at `DAMPING` of critical, draws to the device: the stiffness is that of taut's coupling, so forces can be compared. No gravity,
no friction. `GRIDS` is what is tried on the training hands; the best J there is what is judged, for each engine and scene by itself.
The rendered force is the spring's, without its damper, which is the better choice for every one of them.
"""

import itertools
import time

import numpy as np
from scipy.spatial.transform import Rotation

from scenes import STIFFNESS
from shapes import hull_faces, write_obj

DAMPING = 1.0  # of critical
PATIENCE = 20.0  # s


def grid(**choices):
    return [dict(zip(choices, values)) for values in itertools.product(*choices.values())]


class Sprung:
    """What all dynamics engines share: the spring, and the time that the engine itself takes (thread CPU time, s)."""

    def __init__(self, scene, folder, mass, substeps, **settings):
        self.scene, self.mass, self.substeps, self.folder = scene, mass, substeps, folder
        self.dt = 1e-3 / substeps
        self.inertia = mass * scene.radius**2
        self.last = None
        self.build(**settings)

    def write_pieces(self, part, name, scale=1.0):
        paths = []
        for k, piece in enumerate(part.pieces):
            paths.append(self.folder / f"{name}-{k}.obj")
            write_obj(paths[-1], piece * scale, hull_faces(piece))
        return paths

    def tick(self, t, p, q):
        """One millisecond towards the device's pose: the body's pose, and the engine's own time."""
        rotation = Rotation.from_quat(q)
        if self.last is None:
            self.place(p, q)
            self.last = (p, rotation)
        v = (p - self.last[0]) / 1e-3
        w = (rotation * self.last[1].inv()).as_rotvec() / 1e-3
        before, self.last = self.last, (p, rotation)
        damper, spent = 2 * DAMPING * np.sqrt(STIFFNESS * self.mass), 0.0
        turn = Rotation.from_rotvec(w * self.dt)
        goal_p, goal_r = before
        for _ in range(self.substeps):
            goal_p, goal_r = goal_p + v * self.dt, turn * goal_r
            at, orientation, velocity, spin = self.state()
            force = STIFFNESS * (goal_p - at) + damper * (v - velocity)
            error = (goal_r * Rotation.from_quat(orientation).inv()).as_rotvec()
            torque = self.scene.radius**2 * (STIFFNESS * error + damper * (w - spin))
            began = time.thread_time()
            self.step(force, torque)
            spent += time.thread_time() - began
        at, orientation, _, _ = self.state()
        return np.concatenate([at, orientation]), spent


class MuJoCo(Sprung):
    """Convex pieces, frictionless contacts (condim 1), Newton solver, implicitfast."""

    label, made_for = "MuJoCo", "articulated robots and learning, with contacts that are soft by design"
    GRIDS = grid(mass=[0.01, 0.05], substeps=[1, 4], contact=["stiff"])
    CONTACTS = {"default": "", "stiff": 'solref="0.002 1" solimp="0.99 0.9999 0.0001 0.5 2"'}

    def assets(self, contact):
        meshes, geoms = [], {"held": [], "obstacle": []}
        for name, part in (("held", self.scene.held), ("obstacle", self.scene.obstacle)):
            for k, piece in enumerate(part.pieces):
                numbers = " ".join(f"{x:.17g}" for x in piece.ravel())
                meshes.append(f'<mesh name="{name}{k}" vertex="{numbers}"/>')
                geoms[name].append(f'<geom type="mesh" mesh="{name}{k}" condim="1" friction="0 0 0" {self.CONTACTS[contact]}/>')
        return meshes, geoms

    def build(self, contact):
        import mujoco

        self.engine = mujoco
        meshes, geoms = self.assets(contact)
        i = self.inertia
        self.model = mujoco.MjModel.from_xml_string(
            f"""<mujoco><option timestep="{self.dt}" integrator="implicitfast" gravity="0 0 0"/><size memory="200M"/>
            <asset>{"".join(meshes)}</asset><worldbody>{"".join(geoms["obstacle"])}<body name="held"><freejoint/>
            <inertial pos="0 0 0" mass="{self.mass}" diaginertia="{i} {i} {i}"/>{"".join(geoms["held"])}</body></worldbody></mujoco>"""
        )
        self.data = mujoco.MjData(self.model)

    def place(self, p, q):
        self.data.qpos[:] = [*p, q[3], *q[:3]]

    def state(self):
        q = self.data.qpos[[4, 5, 6, 3]]
        return self.data.qpos[:3].copy(), q, self.data.qvel[:3].copy(), Rotation.from_quat(q).apply(self.data.qvel[3:])

    def step(self, force, torque):
        self.data.xfrc_applied[1, :3], self.data.xfrc_applied[1, 3:] = force, torque
        self.engine.mj_step(self.model, self.data)


class MuJoCoSdf(MuJoCo):
    """Signed distance fields of the meshes (geom type sdf)."""

    label, made_for = "MuJoCo, SDF", "what convex pieces cannot say: nuts, bolts and gears, at some cost"
    GRIDS = grid(mass=[0.01, 0.05], substeps=[1], contact=["stiff"])

    def assets(self, contact):
        geoms, meshes = {}, []
        for name, part in (("held", self.scene.held), ("obstacle", self.scene.obstacle)):
            part.write(self.folder / f"sdf-{name}.obj")
            meshes.append(f'<mesh name="{name}" file="{self.folder}/sdf-{name}.obj"/>')
            geoms[name] = [f'<geom type="sdf" mesh="{name}" condim="1" friction="0 0 0" {self.CONTACTS[contact]}/>']
        return meshes, geoms


class Bullet(Sprung):
    """PyBullet: convex pieces as compounds, collision margin 0, 200 iterations; lengths scaled by `scale`, as its manual advises for small parts."""

    label, made_for = "PyBullet", "games and robot learning: fast and stable in sight, not exact in the small"
    GRIDS = grid(mass=[0.01], substeps=[1, 4], scale=[1.0, 100.0])

    def build(self, scale):
        import pybullet
        from pybullet_utils.bullet_client import BulletClient

        self.scale, self.engine = scale, BulletClient(pybullet.DIRECT)
        e = self.engine
        e.setPhysicsEngineParameter(fixedTimeStep=self.dt, numSubSteps=0, numSolverIterations=200)
        self.fixed = self.load("obstacle", self.scene.obstacle, True)
        self.body = self.load("held", self.scene.held, False)
        for body in (self.fixed, self.body):
            e.changeDynamics(body, -1, lateralFriction=0, restitution=0, linearDamping=0, angularDamping=0, collisionMargin=0.0)
        e.changeDynamics(self.body, -1, mass=self.mass, localInertiaDiagonal=[self.inertia * scale**2] * 3)

    def load(self, name, part, fixed):
        collisions = "".join(
            f'<collision><geometry><mesh filename="{path}"/></geometry></collision>' for path in self.write_pieces(part, name, self.scale)
        )
        urdf = self.folder / f"{name}.urdf"
        urdf.write_text(
            f'<robot name="{name}"><link name="base"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
            f"{collisions}</link></robot>"
        )
        return self.engine.loadURDF(str(urdf), useFixedBase=fixed)

    def place(self, p, q):
        self.engine.resetBasePositionAndOrientation(self.body, np.array(p) * self.scale, q)

    def state(self):
        p, q = self.engine.getBasePositionAndOrientation(self.body)
        v, w = self.engine.getBaseVelocity(self.body)
        return np.array(p) / self.scale, np.array(q), np.array(v) / self.scale, np.array(w)

    def step(self, force, torque):
        e, s = self.engine, self.scale
        at, _ = e.getBasePositionAndOrientation(self.body)
        e.applyExternalForce(self.body, -1, force * s, at, e.WORLD_FRAME)
        e.applyExternalTorque(self.body, -1, torque * s * s, e.WORLD_FRAME)
        e.stepSimulation()

    def close(self):
        self.engine.disconnect()


class DrakePoint(Sprung):
    """Drake's discrete plant (SAP): convex pieces, point contact."""

    label, made_for = "Drake, point", "model-based design of robots, where a force must be one that physics explains"
    GRIDS = grid(mass=[0.01, 0.05], substeps=[4], stiffness=[1e6])
    hydroelastic = False

    def build(self, stiffness):
        from pydrake import geometry, math, multibody, systems
        from pydrake.multibody import plant as plants, tree
        from pydrake.systems.analysis import Simulator
        from pydrake.systems.framework import DiagramBuilder

        self.modules = (geometry, math, plants)
        builder = DiagramBuilder()
        config = plants.MultibodyPlantConfig(
            time_step=self.dt, contact_model="hydroelastic_with_fallback" if self.hydroelastic else "point", discrete_contact_approximation="sap"
        )
        self.plant, _ = plants.AddMultibodyPlant(config, builder)
        self.plant.mutable_gravity_field().set_gravity_vector([0, 0, 0])
        i = tree.UnitInertia(*[self.scene.radius**2] * 3)
        self.body = self.plant.AddRigidBody("held", tree.SpatialInertia(self.mass, np.zeros(3), i))
        for name, part, body in (("obstacle", self.scene.obstacle, self.plant.world_body()), ("held", self.scene.held, self.body)):
            for k, path in enumerate(self.write_pieces(part, name)):
                properties = geometry.ProximityProperties()
                properties.AddProperty("material", "relaxation_time", 2 * self.dt)  # SAP's own default, 0.1 s, lets a hand sink in
                geometry.AddContactMaterial(None, None if self.hydroelastic else stiffness, plants.CoulombFriction(0.0, 0.0), properties)
                if self.hydroelastic and name == "held":
                    geometry.AddCompliantHydroelasticProperties(0.002, stiffness, properties)
                elif self.hydroelastic:
                    geometry.AddRigidHydroelasticProperties(0.002, properties)
                self.plant.RegisterCollisionGeometry(body, math.RigidTransform(), geometry.Convex(str(path)), f"{name}{k}", properties)
        self.plant.Finalize()
        diagram = builder.Build()
        self.simulator = Simulator(diagram)
        self.context = self.plant.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())
        self.port = self.plant.get_applied_spatial_force_input_port()
        self.push = plants.ExternallyAppliedSpatialForce()
        self.push.body_index, self.push.p_BoBq_B = self.body.index(), np.zeros(3)
        self.spatial = multibody.math.SpatialForce
        self.ticks = 0

    def place(self, p, q):
        _, math, _ = self.modules
        from pydrake.common.eigen_geometry import Quaternion

        pose = math.RigidTransform(Quaternion(wxyz=np.array([q[3], *q[:3]]) / np.linalg.norm(q)), p)
        self.plant.SetFreeBodyPose(self.context, self.body, pose)

    def state(self):
        pose = self.plant.GetPositions(self.context)
        speed = self.plant.GetVelocities(self.context)
        return pose[4:], pose[[1, 2, 3, 0]], speed[3:], speed[:3]

    def step(self, force, torque):
        self.push.F_Bq_W = self.spatial(tau=torque, f=force)
        self.port.FixValue(self.context, [self.push])
        self.ticks += 1
        self.simulator.AdvanceTo(self.ticks * self.dt)


class DrakeHydro(DrakePoint):
    """Drake's hydroelastic contact: the held pieces compliant, the obstacle's rigid."""

    label, made_for = "Drake, hydroelastic", "grasps and contacts over areas, with pressure as in a soft pad"
    GRIDS = grid(mass=[0.05], substeps=[1], stiffness=[1e7, 1e8])
    hydroelastic = True


class Coal(Sprung):
    """coal finds contacts of the pieces (patches, where faces meet); a penalty spring on each patch, and semi-implicit steps, in Python."""

    label, made_for = "coal and penalty", "distances and contacts for planners and simulators: it is no simulator"
    GRIDS = grid(mass=[0.05], substeps=[4], stiffness=[1e4, 1e5])

    def build(self, stiffness):
        import coal

        self.coal, self.stiffness = coal, stiffness
        self.objects = {}
        for name, part in (("held", self.scene.held), ("obstacle", self.scene.obstacle)):
            self.objects[name] = [coal.CollisionObject(self.convex(piece)) for piece in part.pieces]
        self.low = np.array([piece.min(0) for piece in self.scene.obstacle.pieces])
        self.high = np.array([piece.max(0) for piece in self.scene.obstacle.pieces])
        self.request, self.patch_request = coal.CollisionRequest(), coal.ContactPatchRequest()
        self.request.num_max_contacts, self.request.enable_contact = 1, True
        self.v, self.w = np.zeros(3), np.zeros(3)

    def convex(self, piece):
        coal = self.coal
        points, faces = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
        for point in piece:
            points.append(point)
        for a, b, c in hull_faces(piece):
            faces.append(coal.Triangle(int(a), int(b), int(c)))
        return coal.Convex(points, faces)

    def place(self, p, q):
        self.p, self.q = np.array(p), np.array(q)

    def state(self):
        return self.p, self.q, self.v, self.w

    def contacts(self):
        """Points, normals towards the held part, depths, shares of a pair's stiffness."""
        coal, turn = self.coal, Rotation.from_quat(self.q).as_matrix()
        pose = coal.Transform3s(turn, self.p)
        for held, piece in zip(self.objects["held"], self.scene.held.pieces):
            held.setTransform(pose)
            corners = piece @ turn.T + self.p
            meets = ((self.low <= corners.max(0)) & (corners.min(0) <= self.high)).all(1)
            for k in np.flatnonzero(meets):
                result, fixed = coal.CollisionResult(), self.objects["obstacle"][k]
                if not coal.collide(fixed, held, self.request, result):
                    continue
                patches = coal.ContactPatchResult()
                coal.computeContactPatch(fixed, held, result, self.patch_request, patches)
                contact = result.getContact(0)
                if patches.numContactPatches() and (patch := patches.getContactPatch(0)).size() > 2:
                    for i in range(patch.size()):
                        yield np.array(patch.getPoint(i)), np.array(contact.normal), -contact.penetration_depth, 1 / patch.size()
                else:
                    yield np.array(contact.pos), np.array(contact.normal), -contact.penetration_depth, 1.0

    def step(self, force, torque):
        force, torque = force.copy(), torque.copy()
        damper = 2 * np.sqrt(self.stiffness * self.mass)
        for point, normal, depth, share in self.contacts():
            arm = point - self.p
            approach = (self.v + np.cross(self.w, arm)) @ normal
            push = max(0.0, share * (self.stiffness * depth - 0.5 * damper * approach))
            force += push * normal
            torque += np.cross(arm, push * normal)
        self.v = self.v + self.dt * force / self.mass
        self.w = self.w + self.dt * torque / self.inertia
        self.p = self.p + self.dt * self.v
        self.q = (Rotation.from_rotvec(self.dt * self.w) * Rotation.from_quat(self.q)).as_quat()


class Taut:
    """taut as it comes, at 1 kHz in one thread; a tight fit is told its play, as docs/scene-file.md asks for."""

    label, made_for = "taut", "one held part against what it touches, felt by a hand: it is no dynamics engine"
    GRIDS = [{}]

    def __init__(self, scene, folder):
        import taut

        scene.held.write(folder / "held.obj")
        scene.obstacle.write(folder / "obstacle.obj")
        start = scene.trace("judge")[0]
        play = f"[method]\nclearance = {scene.clearance}\n" if scene.clearance else ""
        (folder / "scene.toml").write_text(
            f"""name = "league"
[god_object]
shape = {{ mesh = "held.obj" }}
mass = 1.0
reference_point = [0.0, 0.0, 0.0]
pose = {{ position = {start[1:4].tolist()} }}
[[obstacle]]
name = "obstacle"
shape = {{ mesh = "obstacle.obj" }}
[coupling]
rotation_metric = {scene.radius}
[limits]
force = 40.0
torque = 2.0
{play}"""
        )
        self.sim = taut.Simulation(str(folder / "scene.toml"))
        assert self.sim.stiffness == STIFFNESS
        self.felt = None

    def tick(self, t, p, q):
        device = np.array([*p, q[3], *q[:3]])
        began = time.thread_time()
        self.sim.update(device)
        force = self.sim.force(t, device)
        spent = time.thread_time() - began
        self.felt = force.wrench.copy()
        pose = self.sim.god_object
        return np.array([*pose[:3], *pose[4:], pose[3]]), spent


ALL = [Taut, MuJoCo, Bullet, DrakePoint, MuJoCoSdf, DrakeHydro, Coal]


def run(engine_class, scene, which, folder, settings):
    """Poses, wrenches on the hand and times (s) for each millisecond of a hand."""
    from oracle import wrench

    folder.mkdir(parents=True, exist_ok=True)
    trace = scene.trace(which)
    engine = engine_class(scene, folder, **settings)
    poses, times, own = [], [], []
    began = time.process_time()
    for row in trace:
        if time.process_time() - began > PATIENCE:
            raise TimeoutError(f"more than {PATIENCE:.0f} s of CPU time for {row[0]:.2f} s of a hand")
        pose, spent = engine.tick(row[0], row[1:4], row[4:])
        if not np.isfinite(pose).all():
            raise ArithmeticError(f"a pose that is no number after {row[0]:.3f} s")
        poses.append(pose)
        times.append(spent)
        own.append(getattr(engine, "felt", None))
    if hasattr(engine, "close"):
        engine.close()
    poses = np.array(poses)
    forces = np.array(own) if own[0] is not None else wrench(scene, trace, poses)
    return poses, forces, np.array(times)
