//! Calls a loop compiled for the widest instructions that the processor has.

/// `fastest!(f(arguments))` calls `f`, an `#[inline(always)]` function, compiled once for AVX2 with fused
/// multiplication and addition and once for any processor; the processor decides which.
macro_rules! fastest {
    ($function:ident($($argument:expr),* $(,)?)) => {{
        #[cfg(target_arch = "x86_64")]
        {
            #[target_feature(enable = "avx2,fma")]
            fn wide<R>(body: impl FnOnce() -> R) -> R {
                body()
            }
            if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
                // SAFETY: `wide` asks for AVX2 and FMA, and the processor has just said that it has both.
                #[expect(unsafe_code, reason = "the only way to call a function for a processor found at run time")]
                unsafe {
                    wide(|| $function($($argument),*))
                }
            } else {
                $function($($argument),*)
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        {
            $function($($argument),*)
        }
    }};
}

pub(crate) use fastest;

/// A loop with all that it works on. Its `run` is `#[inline(always)]`.
pub(crate) trait FastLoop {
    /// Runs it.
    fn run(self);
}

/// Runs a loop as [`fastest!`] does, without a closure between: a large one is not always compiled for AVX2.
pub(crate) fn run_fastest(work: impl FastLoop) {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2,fma")]
        fn wide(work: impl FastLoop) {
            work.run();
        }
        if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
            // SAFETY: `wide` asks for AVX2 and FMA, and the processor has just said that it has both.
            #[expect(
                unsafe_code,
                reason = "the only way to call a function for a processor found at run time"
            )]
            unsafe {
                wide(work);
            }
            return;
        }
    }
    work.run();
}
