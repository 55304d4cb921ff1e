//! Real-time priority for threads that must answer in time.

/// Asks for real-time priority for this thread; returns whether it was granted.
#[cfg(unix)]
#[must_use]
pub fn request_real_time() -> bool {
    use thread_priority::{
        RealtimeThreadSchedulePolicy, ThreadPriority, ThreadSchedulePolicy, set_thread_priority_and_policy,
        thread_native_id,
    };
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    let Ok(priority) = 50_u8.try_into() else { return false };
    set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(priority), policy)
        .is_ok()
}

/// Elsewhere there are no such policies: none is granted, and the caller reports it.
#[cfg(not(unix))]
#[must_use]
pub fn request_real_time() -> bool {
    false
}
