//! What nobody has tried.

/// What every program says of itself, a line each.
pub(crate) fn warning(reach_is_checked: bool) -> [&'static str; 4] {
    [
        "Written by trueline. NOT TRIED ON A REAL CONTROLLER: check it in the maker's simulation first,",
        "then run it slowly, with the enabling device in hand.",
        if reach_is_checked {
            "Reach and singularities were checked for the arm of the plan; collisions are not checked."
        } else {
            "Reach, singularities and collisions of the arm are not checked."
        },
        "The poses are those of the tool whose poses the calibration is relative to: keep that tool active.",
    ]
}
