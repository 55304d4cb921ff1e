//! Options that overwrite numbers of a simulated scenario.

use crate::failure::Failure;

/// A field, the option that overwrites it, the option's unit in SI, its name and its least value.
pub type Override<'a> = (&'a mut f64, Option<f64>, f64, &'static str, f64);

pub fn apply((field, option, unit, name, least): Override<'_>) -> Result<(), Failure> {
    let Some(value) = option else { return Ok(()) };
    if !value.is_finite() || value < least {
        return Err(Failure::new(
            format!("`{name}`: expected a number of {least} or more, found {value}"),
            "see trueline simulate --help",
        ));
    }
    *field = value * unit;
    Ok(())
}

/// A share of all: 0.4 is 40 %.
pub fn share(name: &str, option: Option<f64>, field: &mut f64) -> Result<(), Failure> {
    match option {
        None => Ok(()),
        Some(share) if (0.0..=1.0).contains(&share) => {
            *field = share;
            Ok(())
        }
        Some(share) => Err(Failure::new(
            format!("`{name}`: expected a share from 0 to 1, found {share}"),
            format!("40 % is {name} 0.4"),
        )),
    }
}
