//! Which vendors' libraries this machine has, as the plug-ins of `plugins/` would load them: by the paths of the system's loader.

use super::library::loads;

/// A vendor's library and the plug-in that calls it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VendorLibrary {
    /// Whose devices it drives.
    pub vendor: &'static str,
    /// Its file, which the plug-in loads where no option `library` names another.
    pub file: &'static str,
    /// The plug-in: `device-bridge/plugins/NAME.c`, built as `taut_NAME.so`.
    pub plugin: &'static str,
}

/// Those for which there is a plug-in.
pub const VENDOR_LIBRARIES: [VendorLibrary; 3] = [
    VendorLibrary {
        vendor: "Force Dimension",
        file: "libdhd.so",
        plugin: "dhd",
    },
    VendorLibrary {
        vendor: "3D Systems",
        file: "libHD.so",
        plugin: "hd",
    },
    VendorLibrary {
        vendor: "Haption",
        file: "libVirtuoseAPI.so",
        plugin: "virtuose",
    },
];

/// Whether a library can be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum VendorLibraryState {
    /// It loads.
    Loads,
    /// It is on none of the loader's paths.
    Absent,
    /// It is there and does not load: what the system says.
    Broken(String),
}

impl VendorLibrary {
    /// Loads it, which runs what it does when it is loaded, and opens no device.
    #[must_use]
    pub fn state(&self) -> VendorLibraryState {
        match loads(self.file) {
            Ok(()) => VendorLibraryState::Loads,
            Err(cause) if is_absent(self.file, &cause) => VendorLibraryState::Absent,
            Err(cause) => VendorLibraryState::Broken(cause),
        }
    }
}

/// Of a library that lacks another one the loader names the other.
fn is_absent(file: &str, cause: &str) -> bool {
    cause.contains(&format!("{file}: ")) && cause.to_lowercase().contains("no such file")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_is_what_its_plug_in_loads_by_itself() {
        for library in VENDOR_LIBRARIES {
            let source = format!(
                "{}/plugins/{}.c",
                env!("CARGO_MANIFEST_DIR"),
                library.plugin
            );
            let source =
                std::fs::read_to_string(&source).unwrap_or_else(|e| panic!("{source}: {e}"));
            let default = format!("*library = \"{}\"", library.file);
            assert!(source.contains(&default), "{default}");
        }
    }

    #[test]
    fn a_library_that_lacks_another_one_is_not_absent() {
        let says = |lacking: &str| {
            format!("{lacking}: cannot open shared object file: No such file or directory")
        };
        assert!(is_absent("libHD.so", &says("libHD.so")));
        assert!(!is_absent("libHD.so", &says("libHDU.so")));
        assert!(!is_absent("libHD.so", "/lib/libHD.so: file too short"));
    }
}
