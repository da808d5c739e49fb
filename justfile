# Recipes for https://github.com/casey/just; each is short enough to type without it.

# What there is
default:
    @just --list

# Format, clippy, docs
lint:
    cargo fmt --check
    cargo clippy --all-targets -- -D warnings
    cargo clippy --all-targets --features stats -- -D warnings
    RUSTDOCFLAGS="-D warnings" cargo doc --no-deps

# All tests, at the speed of a release
test *arguments:
    cargo test --release {{arguments}}

# All tests without AVX and FMA: the hits must be the same
test-baseline:
    RUSTFLAGS="" cargo test --release --tests --target-dir target/baseline

# All benches; Embree takes part if it is there
bench *arguments:
    cargo bench {{arguments}}

# Instructions a ray, by Valgrind, which knows no AVX-512
instructions:
    RUSTFLAGS="-C target-cpu=x86-64-v3" cargo bench --bench instructions --target-dir target/x86-64-v3

# Against Embree, natively and from Python; `just compare mesh.obj` takes a mesh of yours
compare mesh="":
    #!/usr/bin/env bash
    set -euo pipefail
    venv=target/venv
    [[ -x $venv/bin/python ]] || python3 -m venv "$venv"
    "$venv/bin/python" -m pip install --quiet ./python embreex matplotlib trimesh
    export PATH="$PWD/$venv/bin:$PATH"
    OCTRAY_BENCH_MESH="{{mesh}}" cargo bench --bench embree -- --svg target/ratios.svg
    python benches/embreex_compare.py {{mesh}}

# The pictures of the README again
gallery:
    cargo build --release
    for scene in scenes/*.toml; do \
        target/release/octray render "$scene" -o "docs/gallery/$(basename "$scene" .toml).png"; \
    done
    for samples in 4 16 64 256; do \
        target/release/octray render scenes/penumbra.toml --shadow-samples $samples \
            -o docs/gallery/penumbra-$samples.png; \
    done
    rm docs/gallery/penumbra.png
    @test -z "$(find docs/gallery -size +300k)" || { echo "larger than 300 kB:"; find docs/gallery -size +300k; exit 1; }

# The tests on made-up input with many times as many rounds as usual. At 100: 1.4e9 rays against the
# reference, 1.1e9 watertight, 2.3e9 visibility samples, in about three hours of one core.
# OCTRAY_SKIP=100 leaves out the first 100 times, so that a soak goes on where another one ended.
soak times="100":
    OCTRAY_SOAK={{times}} PROPTEST_CASES=$((256 * {{times}})) cargo test --release -- --nocapture

# A fuzz target (scene_file, obj_file, ply_file, mtl_file, geometry) for a while; needs a nightly toolchain and
# `cargo install cargo-fuzz`. What breaks something belongs into tests/fuzzed/TARGET.
fuzz target seconds="300":
    mkdir -p fuzz/corpus/{{target}}
    RUSTFLAGS="-C target-cpu=native" cargo +nightly fuzz run {{target}} fuzz/corpus/{{target}} \
        tests/fuzzed/{{target}} -- -max_total_time={{seconds}} -timeout=20 -detect_leaks=0

# All that continuous integration runs
ci:
    bash .ci/run
