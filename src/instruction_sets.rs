//! Which vector instruction sets this build uses, against what the CPU has.
//!
//! Kernels are compiled for one target, so a build for the baseline leaves a modern CPU half idle:
//! worth a line in `octray info`.

/// The vector instruction sets of a build and of the CPU that it runs on, in the names of rustc's
/// `target_feature`, from old to new.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InstructionSets {
    /// Those that the build uses.
    pub build: Vec<&'static str>,
    /// Those that the CPU has.
    pub cpu: Vec<&'static str>,
}

impl InstructionSets {
    /// Those of this build and this CPU.
    pub fn detect() -> Self {
        let (mut build, mut cpu) = (Vec::new(), Vec::new());
        // Two macros of the standard library with one list of literals.
        #[cfg(target_arch = "x86_64")]
        macro_rules! look {
            ($($name:tt),*) => {$(
                if cfg!(target_feature = $name) {
                    build.push($name);
                }
                if std::arch::is_x86_feature_detected!($name) {
                    cpu.push($name);
                }
            )*};
        }
        #[cfg(target_arch = "x86_64")]
        look!("sse2", "sse4.1", "sse4.2", "avx", "avx2", "fma", "avx512f", "avx512dq", "avx512vl");
        #[cfg(target_arch = "aarch64")]
        {
            // Part of every such CPU.
            build.push("neon");
            cpu.push("neon");
        }
        let _ = (&mut build, &mut cpu);
        Self { build, cpu }
    }

    /// Those that the CPU has and the build leaves unused.
    pub fn unused(&self) -> Vec<&'static str> {
        self.cpu.iter().copied().filter(|name| !self.build.contains(name)).collect()
    }

    /// The command that builds for this CPU, if that would use more of it.
    pub fn rebuild_command(&self) -> Option<&'static str> {
        (!self.unused().is_empty())
            .then_some("RUSTFLAGS=\"-C target-cpu=native\" cargo build --release")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cpu_has_what_the_build_uses() {
        let sets = InstructionSets::detect();
        assert!(sets.build.iter().all(|name| sets.cpu.contains(name)), "{sets:?}");
        let full = InstructionSets { build: sets.cpu.clone(), cpu: sets.cpu };
        assert_eq!(full.rebuild_command(), None);
    }

    #[test]
    fn a_baseline_build_tells_how_to_rebuild() {
        let sets = InstructionSets { build: vec!["sse2"], cpu: vec!["sse2", "avx2"] };
        assert_eq!(sets.unused(), ["avx2"]);
        assert!(sets.rebuild_command().is_some_and(|line| line.contains("native")));
    }
}
