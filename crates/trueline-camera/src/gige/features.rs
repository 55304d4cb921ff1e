//! The features of a GigE Vision camera.

use crate::genicam::{Features, Refusal};
use telegenic::GenICamera;

impl Features for GenICamera {
    fn has_feature(&self, name: &str) -> bool {
        Self::has_feature(self, name)
    }

    fn get_integer(&mut self, name: &str) -> Result<i64, Refusal> {
        Self::get_integer(self, name).map_err(|error| Refusal::of(name, &error))
    }

    fn set_integer(&mut self, name: &str, value: i64) -> Result<(), Refusal> {
        Self::set_integer(self, name, value).map_err(|error| Refusal::of(name, &error))
    }

    fn integer_bounds(&mut self, name: &str) -> Result<(i64, i64), Refusal> {
        Self::integer_bounds(self, name).map_err(|error| Refusal::of(name, &error))
    }

    fn integer_increment(&mut self, name: &str) -> Result<i64, Refusal> {
        Self::integer_increment(self, name).map_err(|error| Refusal::of(name, &error))
    }

    fn get_float(&mut self, name: &str) -> Result<f64, Refusal> {
        Self::get_float(self, name).map_err(|error| Refusal::of(name, &error))
    }

    fn set_float(&mut self, name: &str, value: f64) -> Result<(), Refusal> {
        Self::set_float(self, name, value).map_err(|error| Refusal::of(name, &error))
    }

    fn float_bounds(&mut self, name: &str) -> Result<(f64, f64), Refusal> {
        Self::float_bounds(self, name).map_err(|error| Refusal::of(name, &error))
    }

    fn get_boolean(&mut self, name: &str) -> Result<bool, Refusal> {
        Self::get_boolean(self, name).map_err(|error| Refusal::of(name, &error))
    }

    fn set_boolean(&mut self, name: &str, value: bool) -> Result<(), Refusal> {
        Self::set_boolean(self, name, value).map_err(|error| Refusal::of(name, &error))
    }

    fn get_enum(&mut self, name: &str) -> Result<String, Refusal> {
        Self::get_enum(self, name).map_err(|error| Refusal::of(name, &error))
    }

    fn set_enum(&mut self, name: &str, entry: &str) -> Result<(), Refusal> {
        Self::set_enum(self, name, entry).map_err(|error| Refusal::of(name, &error))
    }

    fn enum_entries(&mut self, name: &str) -> Result<Vec<String>, Refusal> {
        Self::enum_entries(self, name).map_err(|error| Refusal::of(name, &error))
    }

    fn execute(&mut self, name: &str) -> Result<(), Refusal> {
        Self::execute(self, name).map_err(|error| Refusal::of(name, &error))
    }

    fn forget(&mut self) -> Result<(), Refusal> {
        self.invalidate_caches().map_err(|error| Refusal::of("device description", &error))
    }
}
