//! Nothing is allocated after the constructors.
#![allow(unsafe_code, reason = "an allocator that counts is one")]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod cell;

use cell::{Event, Path, TIME_OFFSET_S};
use nalgebra::Vector3;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use trueline_geometry::{Axis, AxisKind, Pose};
use trueline_rt::{
    AxisCarries, ExternalAxis, Placer, PlacerCalibration, Points, Readout, SeamTrack, Settings, StampRule,
    TrackSettings,
};

struct Counting;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: all is passed on to the system's allocator as it came; counting in a `const` thread-local cell allocates nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller's part is that of `System`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above; the pointer came from `System`.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        COUNT.with(|count| count.set(count.get() + 1));
        // SAFETY: as above.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn allocations() -> usize {
    COUNT.with(Cell::get)
}

#[test]
fn the_counter_counts() {
    let before = allocations();
    drop(std::hint::black_box(vec![1_u8; 100]));
    assert!(allocations() > before);
}

#[test]
fn placing_allocates_nothing() {
    let rolling = Readout::ByIndex(1e-6);
    for (rule, readout) in [(StampRule::AsStamped, Readout::AtOnce), (StampRule::LowerEnvelope, rolling)] {
        // Poses are forgotten several times.
        let settings = Settings {
            pose_stamps: rule,
            frame_stamps: rule,
            readout,
            poses_kept: 128,
            ..Settings::default()
        };
        let events = cell::events(Path { speed_m_s: 0.1 }, 5.0, 256, 1);
        let (mut base, mut sigmas) = (vec![[0.0; 3]; 256], vec![0.0; 256]);
        let mut placer = Placer::new(&cell::calibration(TIME_OFFSET_S), &settings).unwrap();
        let before = allocations();
        let mut placed = 0;
        for event in &events {
            match event {
                Event::Pose { stamp_ns, pose } => drop(placer.push_pose(*stamp_ns, pose)),
                Event::Frame { stamp_ns, readings, .. } => {
                    let told = placer.place(*stamp_ns, Points::Profile(readings), &mut base, &mut sigmas);
                    placed += usize::from(told.is_ok());
                }
            }
        }
        std::hint::black_box(placer.health(0));
        assert_eq!(allocations(), before);
        assert!(placed > 100, "{placed}");
    }
}

#[test]
fn placing_among_axes_allocates_nothing() {
    let covariance = ExternalAxis::covariance_of(1e-4, 1e-4, 0.0, 1e-4);
    let axis = Axis::new(AxisKind::Rotary, Vector3::z_axis(), Vector3::new(0.8, 0.1, 0.0));
    let axis = ExternalAxis { axis, carries: AxisCarries::Part, in_pose: None, covariance };
    for rule in [StampRule::AsStamped, StampRule::LowerEnvelope] {
        // Values are forgotten several times.
        let settings = Settings { axis_stamps: rule, poses_kept: 128, ..Settings::default() };
        let calibration = PlacerCalibration { axes: vec![axis], ..cell::calibration(0.0) };
        let (mut base, mut sigmas) = ([[0.0; 3]; 4], [0.0; 4]);
        let mut placer = Placer::new(&calibration, &settings).unwrap();
        let before = allocations();
        let mut placed = 0;
        for k in 0..1500 {
            let stamp_ns = 4_000_000 * k;
            placer.push_pose(stamp_ns, &Pose::translation(1e-4 * k as f64, 0.0, 0.3)).unwrap();
            placer.push_axis(0, stamp_ns, 1e-3 * k as f64).unwrap();
            let told =
                placer.place(stamp_ns - 9_000_000, Points::Profile(&[[0.0, 0.2]; 4]), &mut base, &mut sigmas);
            placed += usize::from(told.is_ok());
        }
        std::hint::black_box((placer.health(0), placer.axis_health(0, 0)));
        assert_eq!(allocations(), before);
        assert!(placed > 1400, "{placed}");
    }
}

#[test]
fn following_allocates_nothing() {
    let mut track = SeamTrack::new(&TrackSettings { points_kept: 100, ..TrackSettings::default() }).unwrap();
    let before = allocations();
    for k in 0..1000 {
        let x = 0.0005 * f64::from(k);
        track.push(&Vector3::new(x, 0.0, 0.1), 5e-5).unwrap();
        if k > 40 {
            let torch = trueline_geometry::Pose::translation(x - 0.01, 0.0, 0.1);
            track.ahead(&torch, 0.02, 0.08).unwrap();
        }
    }
    assert_eq!(allocations(), before);
}
