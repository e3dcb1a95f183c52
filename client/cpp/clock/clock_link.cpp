#include "client/cpp/clock/clock_link.h"

#include <algorithm>

namespace hapticd::client {

void ClockLink::add(const ClockExchange& exchange) {
  try {
    estimator_.add(exchange);
  } catch (...) {
    converter_ = ClockConverter();
    throw;
  }
  converter_.follow(estimator_.bounds(exchange.client_received_ns), estimator_.drift().ppm);
}

ClockLink::Converted ClockLink::convert(std::int64_t client_ns) {
  const std::int64_t converted_ns = converter_.to_daemon_ns(client_ns);
  const ClockBounds bounds = estimator_.bounds(client_ns);
  const std::int64_t offset_ns = converted_ns - client_ns;
  const std::int64_t worst_ns = std::max(bounds.upper_ns - offset_ns, offset_ns - bounds.lower_ns);
  return {converted_ns, 1e-6 * static_cast<double>(worst_ns)};
}

}  // namespace hapticd::client
