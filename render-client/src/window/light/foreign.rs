//! winit's Wayland connection and surfaces, which it hands out as the C pointers of libwayland alone: all of the node's unsafe code.
#![allow(
    unsafe_code,
    reason = "winit hands its Wayland display and surfaces out by C pointers alone"
)]

use std::sync::Arc;

use wayland_backend::client::{Backend, ObjectId};
use wayland_client::protocol::wl_surface::WlSurface;
use wayland_client::{Connection, Proxy};
use winit::event_loop::OwnedDisplayHandle;
use winit::raw_window_handle::{
    HasDisplayHandle, HasWindowHandle, RawDisplayHandle, RawWindowHandle,
};
use winit::window::Window;

/// A second user of winit's connection. Whoever clones the connection (an event queue does) drops the clone before this.
pub(super) struct Foreign {
    /// Dropped before what its pointers belong to.
    connection: Connection,
    /// In the order of the windows.
    surfaces: Vec<WlSurface>,
    _windows: Vec<Arc<Window>>,
    _display: OwnedDisplayHandle,
}

impl Foreign {
    /// `None` where the window system is not Wayland.
    pub(super) fn of(display: OwnedDisplayHandle, windows: Vec<Arc<Window>>) -> Option<Self> {
        let RawDisplayHandle::Wayland(handle) = display.display_handle().ok()?.as_raw() else {
            return None;
        };
        // SAFETY: the pointer is winit's open `wl_display`. `_display` shares winit's connection and so keeps it open until it is dropped, as the
        // last field here, after the connection made of it; that one does not close the display when it is dropped.
        let backend = unsafe { Backend::from_foreign_display(handle.display.as_ptr().cast()) };
        let connection = Connection::from_backend(backend);
        let surface = |window: &Arc<Window>| surface_of(&connection, window);
        let surfaces = windows.iter().map(surface).collect::<Option<Vec<_>>>()?;
        Some(Self {
            connection,
            surfaces,
            _windows: windows,
            _display: display,
        })
    }

    pub(super) fn connection(&self) -> &Connection {
        &self.connection
    }

    /// The surface of the window at this place.
    pub(super) fn surface(&self, place: usize) -> Option<&WlSurface> {
        self.surfaces.get(place)
    }
}

/// The surface of a window that outlives it.
fn surface_of(connection: &Connection, window: &Window) -> Option<WlSurface> {
    let RawWindowHandle::Wayland(handle) = window.window_handle().ok()?.as_raw() else {
        return None;
    };
    // SAFETY: the pointer is the window's live `wl_surface` (its interface is compared), of the display that `connection` was made of; `Foreign`
    // holds the window as long as the surface, and the id knows when winit has destroyed it.
    let id = unsafe { ObjectId::from_ptr(WlSurface::interface(), handle.surface.as_ptr().cast()) };
    WlSurface::from_id(connection, id.ok()?).ok()
}
