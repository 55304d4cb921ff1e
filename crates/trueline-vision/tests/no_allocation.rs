//! After the first picture nothing is allocated.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "it/scenes/mod.rs"]
mod scenes;

use scenes::{detector, pictures, scenario, seam};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use trueline_sim::{Joint as Scene, Look};
use trueline_vision::Joint;

struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: every call is passed on to the system's allocator as it came; counting touches nothing else.
#[expect(unsafe_code, reason = "an allocator cannot be written without")]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: as the caller promises.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: as the caller promises.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn nothing_is_allocated_after_the_first_pictures() {
    let scenario = scenario(4);
    for (scene, joint) in [
        (Scene::fillet(), Joint::Fillet),
        (Scene::Lap { step_m: 3e-3 }, Joint::Lap),
        (Scene::VGroove { depth_m: 5e-3, opening_rad: 1.6 }, Joint::VGroove),
        (Scene::Butt { gap_m: 1.5e-3, mismatch_m: 0.0 }, Joint::Butt),
    ] {
        let pictures = pictures(&scenario, scene, Look::shiny(), 2);
        let mut detector = detector(&scenario);
        // Memory grows to what the pictures of the scan need; then they are looked at again.
        let first: Vec<_> =
            pictures.iter().map(|(image, _)| seam(&mut detector, image, joint).is_ok()).collect();
        assert!(first.iter().any(|found| *found), "{joint:?} is found");
        let before = ALLOCATIONS.with(Cell::get);
        let found = pictures.iter().filter(|(image, _)| seam(&mut detector, image, joint).is_ok()).count();
        assert_eq!(ALLOCATIONS.with(Cell::get), before, "{joint:?}");
        assert_eq!(found, first.iter().filter(|found| **found).count());
    }
}
