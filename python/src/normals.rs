//! Normals of hits: looked up for flat primitives, computed ray by ray where there are spheres.

use std::sync::OnceLock;

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use octray::{BatchRays, Hit};
use pyo3::prelude::*;

use crate::results::empty;
use crate::threads::{chunk, for_each, ranges};

/// The normals of the flat primitives of a scene, once somebody asked for at least as many.
#[derive(Default)]
pub(crate) struct Normals {
    all: OnceLock<Vec<[f32; 3]>>,
}

impl Normals {
    /// The memory of all normals, in bytes.
    pub(crate) fn bytes(&self) -> usize {
        self.all.get().map_or(0, |all| size_of_val(all.as_slice()))
    }

    /// The normals of hits on primitives that do not need the ray; zero for a miss. `counts` has the number
    /// of primitives of each geometry.
    pub(crate) fn of_hits<'py>(
        &self,
        py: Python<'py>,
        scene: &octray::Scene,
        counts: &[usize],
        hits: (&[i32], &[i32]),
        threads: usize,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let (prim_id, geom_id) = hits;
        let len = prim_id.len().min(geom_id.len());
        let total: usize = counts.iter().sum();
        if self.all.get().is_none() && (1..=len).contains(&total) {
            let all = all_normals(py, scene, counts, total, threads)?;
            // Another thread may have been faster, with the same.
            let _ = self.all.set(all);
        }
        let mut firsts = Vec::with_capacity(counts.len());
        let mut first = 0;
        for &count in counts {
            firsts.push((first, count));
            first += count;
        }
        let all = self.all.get();
        fill(py, len, threads, |start, normals| {
            let end = start + normals.len();
            let ids = prim_id[start..end].iter().zip(&geom_id[start..end]);
            for (normal, (&prim_id, &geom_id)) in normals.iter_mut().zip(ids) {
                // A miss names nothing; and the arrays may have been written to since.
                *normal = match all {
                    Some(all) => match firsts.get(geom_id as usize) {
                        Some(&(first, count)) if (prim_id as usize) < count => {
                            all[first + prim_id as usize]
                        }
                        _ => [0.0; 3],
                    },
                    None => flat_normal(scene, geom_id as u32, prim_id as u32),
                };
            }
        })
    }
}

/// The normals where `rays` met what the arrays of `hits` say: `t`, `u`, `v` and both ids.
pub(crate) fn normals_on_rays<'py>(
    py: Python<'py>,
    scene: &octray::Scene,
    rays: &BatchRays<'_>,
    hits: ([&[f32]; 3], [&[i32]; 2]),
    threads: usize,
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let ([t, u, v], [prim_id, geom_id]) = hits;
    fill(py, rays.len(), threads, |start, normals| {
        for (at, normal) in (start..).zip(normals) {
            let (prim_id, geom_id) = (prim_id[at] as u32, geom_id[at] as u32);
            let hit = Hit { t: t[at], u: u[at], v: v[at], prim_id, geom_id };
            *normal = if hit.is_hit() {
                scene.surface(&rays.get(at), &hit).geometric_normal.to_array()
            } else {
                [0.0; 3]
            };
        }
    })
}

/// The normals of all primitives, by geometry and then by number. Spheres have none.
fn all_normals(
    py: Python<'_>,
    scene: &octray::Scene,
    counts: &[usize],
    total: usize,
    threads: usize,
) -> PyResult<Vec<[f32; 3]>> {
    let mut all = vec![[0.0; 3]; total];
    let mut rest = &mut all[..];
    for (geom_id, &count) in counts.iter().enumerate() {
        let (own, others) = rest.split_at_mut(count);
        rest = others;
        let chunk = chunk(count, threads);
        let parts = ranges(count, chunk).zip(own.chunks_mut(chunk));
        for_each(
            py,
            threads,
            parts,
            || (),
            |(), (range, part)| {
                for (prim_id, normal) in range.zip(part) {
                    *normal = flat_normal(scene, geom_id as u32, prim_id as u32);
                }
            },
        )?;
    }
    Ok(all)
}

fn flat_normal(scene: &octray::Scene, geom_id: u32, prim_id: u32) -> [f32; 3] {
    scene.flat_normal(geom_id, prim_id).map_or([0.0; 3], |normal| normal.to_array())
}

/// An array of so many rows, which `work` fills part by part, each from the row with that number on.
fn fill<'py>(
    py: Python<'py>,
    len: usize,
    threads: usize,
    work: impl Fn(usize, &mut [[f32; 3]]) + Sync,
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let normals: Bound<'py, PyArray1<f32>> = empty(py, 3 * len)?;
    {
        let mut normals = normals.readwrite();
        let rows = normals.as_slice_mut()?.as_chunks_mut::<3>().0;
        let chunk = chunk(len, threads);
        let parts = ranges(len, chunk).zip(rows.chunks_mut(chunk));
        for_each(py, threads, parts, || (), |(), (range, part)| work(range.start, part))?;
    }
    normals.reshape([len, 3])
}
