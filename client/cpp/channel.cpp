#include "client/cpp/channel.h"

#include <fstream>
#include <sstream>
#include <string>

#include "client/cpp/address.h"
#include "client/cpp/certificates.h"
#include "client/cpp/error.h"
#include "client/cpp/tls_failure.h"

namespace hapticd::client {
namespace {

/// A stream over a network that carries nothing any more ends within 15 s: the daemon is asked after so long
/// without a word, and has so long to answer. It takes a question each 5 s.
constexpr int kKeepAliveMs = 9'000;
constexpr int kKeepAliveTimeoutMs = 5'000;

std::string text_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

[[noreturn]] void refuse_connection(const ClientOptions& options) {
  v1::ErrorDetail detail;
  detail.set_what("no daemon answers");
  detail.set_where(options.address);
  detail.set_remedy("start hapticd, or name its address with --server or HAPTICD_SERVER");
  if (needs_certificates(options.address)) {
    const CertificateFiles files = find_certificates(options.address, options.certificates);
    if (const auto explained = explain_tls_failure(options.address, files, options.timeout)) {
      detail = *explained;
    }
  } else if (!options.address.starts_with("unix:")) {
    if (const auto explained = explain_plain_failure(options.address, options.timeout)) detail = *explained;
  }
  throw Error(ErrorKind::kUnreachable, "UNAVAILABLE", detail);
}

}  // namespace

std::shared_ptr<grpc::Channel> make_channel(const ClientOptions& options, grpc::ChannelArguments arguments) {
  // A proxy for web traffic must not be used between a client and a device.
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  // A client that connects again after a loss must not wait out the pauses between the attempts of another
  // connection.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepAliveMs);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepAliveTimeoutMs);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA,
                   0);  // a stream that only receives has no end of them
  const std::string target = channel_target(options.address);
  auto credentials = grpc::InsecureChannelCredentials();
  if (needs_certificates(options.address)) {
    const CertificateFiles files = find_certificates(options.address, options.certificates);
    credentials =
        grpc::SslCredentials({text_of(files.authority), text_of(files.key), text_of(files.certificate)});
  }
  return grpc::CreateCustomChannel(target, credentials, arguments);
}

std::shared_ptr<grpc::Channel> open_channel(const ClientOptions& options) {
  auto channel = make_channel(options);
  // Waits until connected, but not for a second attempt once the first was refused.
  const auto deadline = std::chrono::system_clock::now() + options.timeout;
  auto state = channel->GetState(true);
  while (state != GRPC_CHANNEL_READY) {
    if (state == GRPC_CHANNEL_TRANSIENT_FAILURE || !channel->WaitForStateChange(state, deadline)) {
      refuse_connection(options);
    }
    state = channel->GetState(true);
  }
  return channel;
}

}  // namespace hapticd::client
