#pragma once

#include <cstdint>

#include "hal/samples.h"
#include "hapticd/v1/telemetry.pb.h"
#include "rt/record/tick_record.h"

namespace hapticd::server {

void fill_vector(const hal::Vector3& vector, v1::Vector3& message);

/// Reports the groups of a record that exist and are asked for (bits of rt::channel). `sample` is empty
/// before.
void fill(const rt::TickRecord& record, std::uint32_t wanted_channels, v1::TelemetrySample& sample);

}  // namespace hapticd::server
