#pragma once

#include <optional>
#include <vector>

namespace hapticd::study {

/// The slope of log error over log step, by least squares: p of error ≈ C · step^p. Errors up to `floor`
/// (what the reference is worth) and what is not finite are left out; nothing if fewer than two remain.
std::optional<double> order_of_convergence(const std::vector<double>& steps,
                                           const std::vector<double>& errors, double floor);

}  // namespace hapticd::study
