//! What a state asks to be drawn: the instances, and the shadow map where a shadow moved.

use nalgebra::Isometry3;
use taut_proto::scene::Show;

use super::{Bodies, Plan, Renderer, Shadowed};
use crate::renderer::frame::KeyLight;
use crate::renderer::mesh::{Batch, Instance};
use crate::renderer::shadow::ShadowMap;
use crate::renderer::{Gpu, contacts, force, ghost, god_object, obstacles};
use crate::stage::{Bounds, Stage, StageBody};
use crate::timeline::{Latched, State};

impl Renderer {
    /// Takes the state that the next submission draws; draws its shadow map if a shadow moved.
    pub fn set_state(&mut self, gpu: &Gpu, stage: &Stage, latched: &Latched, show: Show) {
        self.take_levels(gpu, |levels| levels.try_recv().ok());
        let state = &latched.state;
        let mut list = InstanceList::default();
        let bodies = self.bodies(stage, state, &mut list);
        let marks = self.marks(stage, state, show, &bodies, &mut list);
        let ghost = show.ghost.then(|| {
            let body = &stage.god_object;
            let own = self.bounds(stage, body, &state.device);
            let instance = ghost::instance(stage, &state.device);
            let scale = body.scale * stage.workbench_from_scene.scaling();
            list.batch(body.mesh, [instance], own, scale)
        });

        self.plan = Plan {
            light: KeyLight::fit(&bodies.bounds, &bodies.all, ShadowMap::TEXELS),
            stale: latched.stale,
            reflections: show.reflections,
            casters: bodies.casters,
            moving: bodies.moving,
            translucent: bodies.translucent,
            marks,
            ghost,
        };
        gpu.queue
            .write_buffer(&self.instances, 0, bytemuck::cast_slice(&list.instances));
        let (held, standing) = self.plan.casters.split_at(bodies.moving);
        let shadowed = Shadowed {
            light: self.plan.light,
            moving: list.of(held),
            standing: list.of(standing),
        };
        self.draw_shadow(gpu, shadowed);
    }

    /// The god-object, and the obstacles that are seen: those that move come first.
    fn bodies(&self, stage: &Stage, state: &State, list: &mut InstanceList) -> DrawnBodies {
        let (mut casters, mut translucent) = (Vec::new(), Vec::new());
        let held = self.bounds(stage, &stage.god_object, &state.god_object);
        let (mut bounds, mut all) = (held, held);
        let scale = stage.workbench_from_scene.scaling();
        let is_opaque =
            |body: &StageBody| body.opacity >= 1.0 && !self.meshes[body.mesh].is_see_through();
        let mut add = |body: &StageBody, instance, own| {
            let batch = list.batch(body.mesh, [instance], own, body.scale * scale);
            if is_opaque(body) {
                casters.push(batch);
            } else if body.opacity > 0.0 {
                translucent.push(batch);
            }
        };
        let god_object = god_object::instance(stage, &state.god_object);
        add(&stage.god_object, god_object, held);
        let mut moving = usize::from(is_opaque(&stage.god_object));
        let moves = |body: &StageBody| state.bodies.iter().any(|(id, _)| *id == body.id);
        let seen = || {
            let seen = stage.obstacles.iter().enumerate();
            seen.filter(|(_, body)| body.opacity > 0.0)
        };
        let moved = seen().filter(|(_, body)| moves(body));
        let stands = seen().filter(|(_, body)| !moves(body));
        for (place, body) in moved.chain(stands) {
            let pose = pose_of(body, state);
            let own = self.bounds(stage, body, pose);
            all = all.union(&own);
            if !self.ground.is(place) {
                bounds = bounds.union(&own);
            }
            let shown = self.ground.shown(place, body);
            add(body, obstacles::instance(stage, &shown, pose), own);
            moving += usize::from(is_opaque(body) && moves(body));
        }
        DrawnBodies {
            casters,
            translucent,
            moving,
            held,
            bounds,
            all,
        }
    }

    /// Contact dots and force arrow, sized by the god-object.
    fn marks(
        &self,
        stage: &Stage,
        state: &State,
        show: Show,
        bodies: &DrawnBodies,
        list: &mut InstanceList,
    ) -> Vec<Batch> {
        let (bounds, radius) = (bodies.bounds, bodies.held.radius);
        let (dot, arrow) = (self.meshes.len() - 2, self.meshes.len() - 1);
        let mut marks = Vec::new();
        if show.contacts {
            let dots = contacts::instances(stage, &state.contacts, radius);
            marks.push(list.batch(dot, dots, bounds, 1.0));
        }
        if show.force {
            let pose = &state.god_object;
            let mark = force::instance(stage, pose, &state.force, &self.god_object_box, radius);
            marks.push(list.batch(arrow, mark, bounds, 1.0));
        }
        marks
    }

    /// Brings the shadow map up to date: what stands only if it or the light moved.
    fn draw_shadow(&mut self, gpu: &Gpu, wanted: Shadowed) {
        let has = self.shadowed.as_ref();
        if has == Some(&wanted) {
            return;
        }
        let stands =
            has.is_some_and(|has| has.light == wanted.light && has.standing == wanted.standing);
        self.shadow.aim(&gpu.queue, &self.plan.light);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let (moving, standing) = self.plan.casters.split_at(self.plan.moving);
        let texels = 1.0 / self.plan.light.texel;
        let per_metre = |_: &Bounds| texels;
        if !stands {
            let mut pass = self.shadow.begin_standing(gpu, &mut encoder);
            pass.set_vertex_buffer(1, self.instances.slice(..));
            self.draw_batches(&mut pass, standing, &per_metre, Bodies::All);
            self.shadow_passes += 1;
        }
        {
            let mut pass = self.shadow.begin_moving(gpu, &mut encoder);
            pass.set_vertex_buffer(1, self.instances.slice(..));
            self.draw_batches(&mut pass, moving, &per_metre, Bodies::All);
        }
        let (light, floor) = (&self.plan.light, &self.floor);
        self.occlusion.draw(gpu, &mut encoder, light, floor);
        gpu.queue.submit([encoder.finish()]);
        self.shadowed = Some(wanted);
    }

    fn bounds(&self, stage: &Stage, body: &StageBody, pose: &Isometry3<f64>) -> Bounds {
        stage.body_bounds(body, pose, &self.mesh_bounds[body.mesh])
    }
}

/// The bodies of one frame.
struct DrawnBodies {
    /// As in [`Plan`].
    casters: Vec<Batch>,
    translucent: Vec<Batch>,
    moving: usize,
    /// Around the god-object.
    held: Bounds,
    /// Around all that is no ground.
    bounds: Bounds,
    all: Bounds,
}

/// Instances of one frame, in the order of the buffer.
#[derive(Default)]
struct InstanceList {
    instances: Vec<Instance>,
}

impl InstanceList {
    fn of(&self, batches: &[Batch]) -> Vec<Instance> {
        let places = batches.iter().flat_map(|batch| batch.instances.clone());
        places.map(|i| self.instances[i as usize]).collect()
    }

    fn batch(
        &mut self,
        mesh: usize,
        instances: impl IntoIterator<Item = Instance>,
        bounds: Bounds,
        scale: f64,
    ) -> Batch {
        let first = self.instances.len() as u32;
        self.instances.extend(instances);
        let instances = first..self.instances.len() as u32;
        Batch {
            mesh,
            instances,
            bounds,
            scale,
        }
    }
}

/// Where a body is: where the state says, else where the scene put it.
fn pose_of<'a>(body: &'a StageBody, state: &'a State) -> &'a Isometry3<f64> {
    let moved = state.bodies.iter().find(|(id, _)| *id == body.id);
    moved.map_or(&body.pose, |(_, pose)| pose)
}
