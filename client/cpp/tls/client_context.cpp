#include "client/cpp/tls/client_context.h"

#include <sys/stat.h>

#include <array>
#include <cstdint>
#include <map>

#include "hal/lock/mutex.h"

namespace hapticd::client {
namespace {

constexpr std::size_t kMaxContexts = 16;

using Paths = std::array<std::string, 3>;  ///< certificate, key, authority

/// What changes when a file does.
using FileState = std::array<std::int64_t, 4>;

FileState state_of(const std::string& path) {
  struct stat found {};
  if (stat(path.c_str(), &found) != 0) return {};
  return {static_cast<std::int64_t>(found.st_ino), found.st_mtim.tv_sec, found.st_mtim.tv_nsec,
          found.st_size};
}

struct Known {
  std::array<FileState, 3> files;
  TlsContext context;
};

struct Contexts {
  Mutex mutex;
  std::map<Paths, Known> known GUARDED_BY(mutex);
};

Contexts& contexts() {
  static Contexts all;
  return all;
}

TlsContext read(const Paths& paths) {
  ERR_clear_error();
  TlsContext context(SSL_CTX_new(TLS_client_method()));
  if (!context || SSL_CTX_set_min_proto_version(context.get(), TLS1_2_VERSION) != 1 ||
      SSL_CTX_use_certificate_chain_file(context.get(), paths[0].c_str()) != 1 ||
      SSL_CTX_use_PrivateKey_file(context.get(), paths[1].c_str(), SSL_FILETYPE_PEM) != 1 ||
      SSL_CTX_load_verify_locations(context.get(), paths[2].c_str(), nullptr) != 1) {
    return nullptr;
  }
  return context;
}

TlsContext shared(const TlsContext& context) {
  SSL_CTX_up_ref(context.get());
  return TlsContext(context.get());
}

}  // namespace

TlsContext client_context(const std::string& certificate, const std::string& key,
                          const std::string& authority) {
  const Paths paths{certificate, key, authority};
  const std::array<FileState, 3> present{state_of(certificate), state_of(key), state_of(authority)};
  Contexts& all = contexts();
  {
    const MutexLock lock(all.mutex);
    const auto found = all.known.find(paths);
    if (found != all.known.end() && found->second.files == present) return shared(found->second.context);
  }
  TlsContext context = read(paths);
  if (!context) return nullptr;
  const MutexLock lock(all.mutex);
  if (all.known.size() >= kMaxContexts) all.known.clear();
  all.known.insert_or_assign(paths, Known{present, shared(context)});
  return context;
}

}  // namespace hapticd::client
