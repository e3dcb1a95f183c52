#pragma once

#include <span>

namespace hapticd::study::extremes {

/// |z| of the largest pole of a linear recursion of second order, y(k) = a y(k-1) + b y(k-2), from what it
/// did: a and b by least squares over the course, the roots of z² - a z - b. `course` is the deviation from
/// where it would rest, at least five values; a course that is over at once has radius 0.
double spectral_radius(std::span<const double> course);

}  // namespace hapticd::study::extremes
