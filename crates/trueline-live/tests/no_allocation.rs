//! What the thread that answers the robot does with a datagram takes nothing from the heap but the answer's bytes.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use trueline_geometry::Pose;
use trueline_live::controller::{Controller, ControllerSettings, Task};
use trueline_live::egm::{Generation, Message};
use trueline_live::guide;
use trueline_live::motion::Reference;
use trueline_live::{FrameFilter, SequenceStatus};

struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: every call is passed on to the system's allocator as it came; counting touches nothing else.
#[expect(unsafe_code, reason = "an allocator cannot be written without")]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller keeps the promises of `GlobalAlloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(place, layout) }
    }

    unsafe fn realloc(&self, place: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: as above.
        unsafe { System.realloc(place, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn allocations() -> usize {
    ALLOCATIONS.with(Cell::get)
}

#[test]
fn datagrams_are_judged_without_the_heap() {
    for generation in [Generation::From6_07, Generation::From7_16] {
        let mut settings = ControllerSettings::new(Task::Guidance { start: Pose::identity() });
        settings.generation = generation;
        let mut robot = Controller::new(settings);
        let from = "192.0.2.1:6510".parse().unwrap();
        let mut filter = FrameFilter::new(None);
        for k in 0..100 {
            let datagram = robot.run_cycle().unwrap();
            let before = allocations();
            let (frame, status) = filter.judge(&datagram, from, k * 4_000_000).unwrap();
            assert_eq!(allocations(), before, "{generation}");
            assert_eq!((frame.generation, status == SequenceStatus::First), (generation, k == 0));
        }
    }
}

#[test]
fn an_answer_is_one_piece_of_the_heap() {
    let before = allocations();
    let bytes = guide::message(1, 2, &Reference::rest(Pose::identity())).encode_to_vec();
    assert_eq!(allocations(), before + 1);
    assert_eq!(bytes.capacity(), bytes.len());
}
