//! The measurement: a qualifying run of every call of Embree, then turns between octray and the
//! best of them.

use octray::Scene;
use octray::workload::Workload;
use serde::Serialize;

use crate::agreement::{Agreement, ReferenceCheck};
use crate::calls::Call;
use crate::clock::Clock;
use crate::contender::{Answers, Contender, Octray, Visibility};
use crate::engine::EmbreeScene;

/// How many calls of Embree take turns with octray.
const FINALISTS: usize = 3;

/// How many calls have more qualifying runs, and how many each.
const SECOND_ROUND: usize = 8;
const SECOND_RUNS: usize = 2;

/// A turn is repeated until it has taken so many seconds.
const TURN_SECONDS: f64 = 0.03;

/// What a workload is measured on.
pub(crate) struct Field<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) embree: &'a [EmbreeScene<'a>],
    pub(crate) workload: &'a Workload,
    /// The same rays as points and samples, if they are shadows of a light.
    pub(crate) visibility: Option<Visibility<'a>>,
    pub(crate) parallel: bool,
    pub(crate) turns: usize,
    pub(crate) clock: Clock,
}

/// A call of Embree in its qualifying run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Qualified {
    pub(crate) call: Call,
    /// Million rays a second.
    pub(crate) rate: f64,
    pub(crate) agreement: Agreement,
}

/// What was measured for one workload. Rates are in million rays a second.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct Row {
    pub(crate) scene: String,
    pub(crate) workload: String,
    pub(crate) threads: usize,
    pub(crate) rays: usize,
    /// The share of the rays that hit.
    pub(crate) hit_share: f64,
    /// Median over the turns.
    pub(crate) octray: Option<f64>,
    /// The call of Embree that was best.
    pub(crate) embree_call: Option<String>,
    /// Its median.
    pub(crate) embree: Option<f64>,
    /// The median of the best call that copies rays and hits, as octray's arrays need it.
    pub(crate) embree_copied: Option<f64>,
    /// Median of octray's rate over that of the best call, turn by turn.
    pub(crate) ratio: Option<f64>,
    /// The smallest and the largest of them.
    pub(crate) ratio_range: Option<[f64; 2]>,
    /// The median of octray's visibility query, on shadows of a light.
    pub(crate) visibility: Option<f64>,
    /// The median of its rate over that of the best call.
    pub(crate) visibility_ratio: Option<f64>,
    pub(crate) agreement: Option<Agreement>,
    /// How many rays were checked against the scalar reference.
    pub(crate) reference_rays: usize,
    /// Why there are no figures, if there are none.
    pub(crate) failure: Option<String>,
}

impl Field<'_> {
    /// Measures octray, if there is an Embree against its best calls.
    pub(crate) fn measure(&self, calls: &mut Vec<Qualified>) -> Row {
        let mut octray = Octray(self.scene);
        let mut ours = Answers::new(self.workload);
        octray.trace(&self.workload.rays, &mut ours, self.parallel);
        let mut row = self.row(&ours);
        let check = ReferenceCheck::new(self.scene, self.workload, &ours, true);
        row.reference_rays = check.rays;
        if !check.holds(true) {
            let (wrong, rays) = (check.wrong, check.rays);
            row.failure =
                Some(format!("octray differs from its reference: {wrong} of {rays} rays"));
            return row;
        }
        if let Some(mut visibility) = self.visibility {
            let mut theirs = Answers::new(self.workload);
            visibility.trace(&self.workload.rays, &mut theirs, self.parallel);
            visibility.collect(&mut theirs);
            // Its rays end a little before the light.
            let agreement = Agreement::new(&ours, &theirs);
            if !agreement.holds() {
                row.failure = Some(format!("octray's queries disagree: {agreement}"));
                return row;
            }
        }
        *calls = self.qualify(&ours);
        let finalists = finalists(calls);
        if finalists.is_empty() && !self.embree.is_empty() {
            let best = calls.first().map(|first| first.agreement.to_string()).unwrap_or_default();
            row.failure = Some(format!("Embree and octray disagree: {best}"));
            return row;
        }
        row.agreement = finalists.first().map(|finalist| finalist.agreement);

        let mut contenders: Vec<Box<dyn Contender + '_>> = vec![Box::new(octray)];
        contenders.extend(finalists.iter().map(|finalist| self.contender(finalist.call)));
        if let Some(visibility) = self.visibility {
            contenders.push(Box::new(visibility));
        }
        let rates = self.take_turns(&mut contenders, &mut ours);
        let medians: Vec<f64> = rates.iter().map(|rates| median(rates)).collect();
        row.octray = Some(medians[0]);
        let embrees = 1..1 + finalists.len();
        row.visibility = self.visibility.map(|_| medians[embrees.end]);
        if let Some(best) = embrees.clone().max_by(|&a, &b| medians[a].total_cmp(&medians[b])) {
            let ratios = |of: &[f64]| -> Vec<f64> {
                of.iter().zip(&rates[best]).map(|(ours, theirs)| ours / theirs).collect()
            };
            row.visibility_ratio = rates.get(embrees.end).map(|rates| median(&ratios(rates)));
            let ratios = ratios(&rates[0]);
            row.embree_call = Some(finalists[best - 1].call.to_string());
            row.agreement = Some(finalists[best - 1].agreement);
            row.embree = Some(medians[best]);
            row.embree_copied = finalists
                .iter()
                .zip(&medians[1..])
                .filter(|(finalist, _)| !finalist.call.packed)
                .map(|(_, &median)| median)
                .max_by(f64::total_cmp);
            row.ratio = Some(median(&ratios));
            let smallest = ratios.iter().copied().fold(f64::INFINITY, f64::min);
            row.ratio_range = Some([smallest, ratios.iter().copied().fold(0.0, f64::max)]);
        }
        row
    }

    /// Measures Embree alone. Its hits are checked against octray's reference, and the calls
    /// against one another.
    pub(crate) fn measure_embree(&self, calls: &mut Vec<Qualified>) -> Row {
        let Some(scene) = self.embree.last() else { return Row::default() };
        let call = Call { mode: scene.mode, width: 1, coherent: false, packed: false };
        let mut theirs = Answers::new(self.workload);
        let mut first = self.contender(call);
        first.trace(&self.workload.rays, &mut theirs, self.parallel);
        let mut row = self.row(&theirs);
        let check = ReferenceCheck::new(self.scene, self.workload, &theirs, false);
        row.reference_rays = check.rays;
        if !check.holds(false) {
            row.failure =
                Some(format!("Embree is wrong for {} of {} rays", check.wrong, check.rays));
            return row;
        }
        *calls = self.qualify(&theirs);
        let finalists = finalists(calls);
        let mut contenders: Vec<_> =
            finalists.iter().map(|finalist| self.contender(finalist.call)).collect();
        let rates = self.take_turns(&mut contenders, &mut theirs);
        let medians = rates.iter().map(|rates| median(rates));
        if let Some((finalist, rate)) =
            finalists.iter().zip(medians).max_by(|(_, a), (_, b)| a.total_cmp(b))
        {
            row.embree_call = Some(finalist.call.to_string());
            row.embree = Some(rate);
            row.agreement = Some(finalist.agreement);
        }
        row
    }

    fn row(&self, answers: &Answers) -> Row {
        let rays = self.workload.rays.len();
        Row {
            workload: self.workload.name.clone(),
            rays,
            hit_share: answers.hit_count() as f64 / rays.max(1) as f64,
            ..Row::default()
        }
    }

    fn contender(&self, call: Call) -> Box<dyn Contender + '_> {
        let scene = self.embree.iter().find(|scene| scene.mode == call.mode);
        call.contender(scene.expect("calls are of scenes that were built"))
    }

    /// Runs each call once, checks it, runs the fast ones again, and sorts them by their best run.
    fn qualify(&self, ours: &Answers) -> Vec<Qualified> {
        let modes = self.embree.iter().map(|scene| scene.mode);
        let mut calls: Vec<Qualified> = modes
            .flat_map(Call::all)
            .map(|call| {
                let mut theirs = Answers::new(self.workload);
                let mut contender = self.contender(call);
                let rate = self.rate(contender.as_mut(), &mut theirs, 1);
                contender.collect(&mut theirs);
                Qualified { call, rate, agreement: Agreement::new(ours, &theirs) }
            })
            .collect();
        let by_rate = |a: &Qualified, b: &Qualified| b.rate.total_cmp(&a.rate);
        calls.sort_by(by_rate);
        let mut theirs = Answers::new(self.workload);
        for qualified in calls.iter_mut().take(SECOND_ROUND) {
            let mut contender = self.contender(qualified.call);
            for _ in 0..SECOND_RUNS {
                let rate = self.rate(contender.as_mut(), &mut theirs, 1);
                qualified.rate = qualified.rate.max(rate);
            }
        }
        calls.sort_by(by_rate);
        calls
    }

    /// The rates of each contender, turn by turn.
    fn take_turns(
        &self,
        contenders: &mut [Box<dyn Contender + '_>],
        answers: &mut Answers,
    ) -> Vec<Vec<f64>> {
        let repeats: Vec<usize> = contenders
            .iter_mut()
            .map(|contender| {
                let rate = self.rate(contender.as_mut(), answers, 1) * 1e6;
                let seconds = self.workload.rays.len() as f64 / rate;
                ((TURN_SECONDS / seconds).ceil() as usize).clamp(1, 50)
            })
            .collect();
        let mut rates = vec![Vec::new(); contenders.len()];
        for turn in 0..self.turns {
            // Each goes first as often as the others.
            for place in 0..contenders.len() {
                let place = (place + turn) % contenders.len();
                let contender = contenders[place].as_mut();
                rates[place].push(self.rate(contender, answers, repeats[place]));
            }
        }
        rates
    }

    /// Million rays a second over so many runs.
    fn rate(&self, contender: &mut dyn Contender, answers: &mut Answers, runs: usize) -> f64 {
        let rays = &self.workload.rays;
        let mut seconds = 0.0;
        for _ in 0..runs {
            contender.prepare(rays, self.workload.query);
            let running = self.clock.start();
            contender.trace(rays, answers, self.parallel);
            seconds += running.seconds();
        }
        (rays.len() * runs) as f64 / seconds / 1e6
    }
}

/// The fastest of the calls whose hits agree, and the fastest that copies if that is not among
/// them.
fn finalists(calls: &[Qualified]) -> Vec<Qualified> {
    let holding = || calls.iter().filter(|call| call.agreement.holds()).copied();
    let mut finalists: Vec<Qualified> = holding().take(FINALISTS).collect();
    if finalists.iter().all(|finalist| finalist.call.packed) {
        finalists.extend(holding().find(|qualified| !qualified.call.packed));
    }
    finalists
}

pub(crate) fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => f64::NAN,
        count if count % 2 == 1 => sorted[count / 2],
        count => 0.5 * (sorted[count / 2 - 1] + sorted[count / 2]),
    }
}
