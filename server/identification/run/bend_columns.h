#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "hal/error.h"
#include "hal/replay/column_mapping.h"
#include "hal/samples.h"
#include "rt/record/observation.h"

namespace hapticd::server {

// Recording of how a device bends: where the encoders see the tip, with what force the device acts on it, and
// where an instrument from outside sees it.

/// Numbers of one row, next to the time: position, device force and external position along three axes, the
/// three along the press, and the sensor's force ("force_x" …, rigid contact only).
inline constexpr std::size_t kBendNumbers = 15;

/// Axes of what was measured along the press only.
struct BendAxes {
  hal::Vector3 press_direction{0.0, 0.0, -1.0};  ///< rig frame, of length 1
  bool rigid = false;
  bool position_along_press = false;
  bool force_along_press = false;
  bool external_along_press = false;
};

struct BendColumns {
  BendAxes axes;
  std::array<bool, kBendNumbers> uses{};  ///< which of bend_roles() are read; all of these must be there
};

/// Columns that are looked for, in the order of a row's numbers. On a rigid object the instrument is not.
std::vector<replay::ColumnRole> bend_roles(bool rigid);

/// Decides for each quantity whether it is read along three axes or along the press: as it is mapped, else as
/// the columns are named, three axes first. Refuses a quantity that is there in neither form or is mapped in
/// both, and a direction without a length. `where` of the error is left to the caller.
hal::Result<BendColumns> choose_bend_columns(bool rigid,
                                             const std::map<std::string, replay::ColumnMapping>& mapped,
                                             const std::vector<std::string>& columns,
                                             const hal::Vector3& press_direction);

/// Fills in an observation. `numbers`: in N and mm; those that are not used are not looked at.
void fill_bend(std::span<const double, kBendNumbers> numbers, const BendAxes& axes,
               rt::Observation& observation) noexcept;

}  // namespace hapticd::server
