#include "client/console/daemon/telemetry_feed.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>

#include "hapticd/v1/rig.pb.h"
#include "hapticd/v1/telemetry.pb.h"

namespace hapticd::console {

namespace {

/// How long a page may be away without losing rows.
constexpr double kKeptS = 4.0;
/// How old rows are when they come: rarely enough to cost little, often enough for a moving picture.
constexpr double kBatchS = 0.02;
constexpr const char* kRigInfo = "/hapticd.v1.RigService/GetRigInfo";
constexpr std::uint64_t kAll = UINT64_MAX / 2;

static_assert(std::endian::native == std::endian::little, "cells of a block are taken as they are");

template <class T>
T cell(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return value;
}

}  // namespace

std::shared_ptr<TelemetryFeed> TelemetryFeed::open(RpcBridge& bridge, const Caller& caller,
                                                   const Post& post) {
  const std::shared_ptr<TelemetryFeed> feed(new TelemetryFeed);
  bridge.call_raw(kRigInfo, {}, caller,
                  [weak = std::weak_ptr(feed), &bridge, caller, post](const grpc::Status& status,
                                                                      const std::string& bytes) {
                    v1::RigInfo info;
                    const bool is_whole = status.ok() && info.ParseFromString(bytes);
                    const double rate_hz = is_whole ? info.loop_rate_hz() : 0.0;
                    const RpcEnd end = RpcBridge::to_end(status);
                    post([weak, &bridge, caller, post, rate_hz, end] {
                      const auto here = weak.lock();
                      if (here && rate_hz > 0.0) return here->subscribe(bridge, caller, rate_hz, post);
                      if (here) here->close(end);
                    });
                  });
  return feed;
}

void TelemetryFeed::subscribe(RpcBridge& bridge, const Caller& caller, double rate_hz, const Post& post) {
  rate_hz_ = rate_hz;
  const std::weak_ptr<TelemetryFeed> weak = weak_from_this();
  const long batch = std::clamp(std::lround(rate_hz * kBatchS), 1L, 1000L);
  stream_ = bridge.open(
      "hapticd.v1.TelemetryService/Subscribe",
      fmt::format(R"({{"encoding":"TELEMETRY_ENCODING_BLOCK","batch_size":{}}})", batch), caller,
      [weak, post](std::string bytes) {
        post([weak, taken = std::move(bytes)] {
          if (const auto here = weak.lock()) here->take(taken);
        });
      },
      [weak, post](RpcEnd end) {
        post([weak, end = std::move(end)] {
          if (const auto here = weak.lock()) here->close(end);
        });
      });
  if (stream_) stream_->grant(kAll);
}

void TelemetryFeed::close(RpcEnd end) {
  end_ = std::move(end);
  tell();
}

TelemetryFeed::~TelemetryFeed() {
  if (stream_) stream_->cancel();
}

void TelemetryFeed::take(const std::string& bytes) {
  v1::TelemetryBatch batch;
  if (!batch.ParseFromString(bytes)) return;
  if (!ring_) {
    for (const v1::TelemetryColumn& column : batch.block().columns()) {
      columns_.push_back({column.name(), column.unit()});
      is_integer_.push_back(column.type() == v1::COLUMN_TYPE_INT64);
    }
    if (columns_.empty()) return;
    ring_.emplace(columns_.size(), static_cast<std::size_t>(std::lround(rate_hz_ * kKeptS)) + 1);
    row_.resize(columns_.size());
  }
  lost_ = batch.dropped_by_subscriber() + batch.dropped_by_server();
  const std::string& rows = batch.block().rows();
  const std::size_t width = columns_.size() * sizeof(double);
  for (std::size_t place = 0; place + width <= rows.size(); place += width) {
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      const char* at = rows.data() + place + i * sizeof(double);
      row_[i] = is_integer_[i] ? static_cast<double>(cell<std::int64_t>(at)) : cell<double>(at);
    }
    ring_->add(row_);
  }
  tell();
}

void TelemetryFeed::tell() {
  const auto listeners = listeners_;  // they may come and go meanwhile
  for (const auto& [number, call] : listeners) call();
}

std::uint64_t TelemetryFeed::on_change(std::function<void()> call) {
  listeners_.emplace_back(next_listener_, std::move(call));
  return next_listener_++;
}

void TelemetryFeed::forget(std::uint64_t listener) {
  std::erase_if(listeners_, [&](const auto& entry) { return entry.first == listener; });
}

}  // namespace hapticd::console
