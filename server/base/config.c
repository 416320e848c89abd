/* SPDX-License-Identifier: MIT */
/* Configuration: one table of keys that flags, environment, file, --print-config and --help all
 * read. */
#include "server/base/config.h"

#include <arpa/inet.h>
#include <assert.h>
#include <ctype.h>
#include <errno.h>
#include <ini.h>
#include <limits.h>
#include <netdb.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "protocol/limits.h"
#include "renderer/base/processors.h"
#include "server/base/device_list.h"

enum key_kind {
    KEY_TEXT,
    KEY_PATH,
    KEY_BYTES,
    KEY_INT,
    KEY_BOOL,
    KEY_LEVEL,
    KEY_AUTO,
    KEY_COMPRESSION,
    KEY_SELF_TEST,
    KEY_DEVICE,
};

struct key {
    const char *name; /* in the file; with dashes a flag; VITRAIL_NAME in the environment */
    enum key_kind kind;
    size_t offset;
    int64_t min, max; /* of numbers; a negative least one: 0 is taken, too */
    const char *help;
};

#define AT(field) offsetof(struct config, field)

static const struct key keys[] = {
    {"listen", KEY_TEXT, AT(listen), 0, 0, "HOST:PORT to serve on; port 0 lets the system choose"},
    {"allow-remote", KEY_BOOL, AT(allow_remote), 0, 0,
     "permit a HOST that other machines can reach (put a proxy in front)"},
    {"allow-host", KEY_TEXT, AT(allow_host), 0, 0,
     "comma-separated names accepted in the Host header beside localhost"},
    {"allow-origin", KEY_TEXT, AT(allow_origin), 0, 0,
     "comma-separated origins (https://cad.example) whose pages may use the API"},
    {"state-dir", KEY_PATH, AT(state_dir), 0, 0,
     "directory that holds everything the daemon keeps"},
    {"job-dir", KEY_PATH, AT(job_dir), 0, 0,
     "existing directory below which jobs may have their results written"},
    {"job-retention-days", KEY_INT, AT(job_retention_days), -1, 36500,
     "days of running after which a job that has ended is forgotten with its results; 0: never"},
    {"job-results-bytes", KEY_BYTES, AT(job_results_bytes), -(1 << 20), INT64_MAX,
     "results of jobs in the state directory; the first that ended go first; 0: no limit"},
    {"cache-bytes", KEY_BYTES, AT(cache_bytes), 1 << 20, INT64_MAX,
     "decoded scenes kept mapped by each worker"},
    {"gpu-budget-bytes", KEY_BYTES, AT(gpu_budget_bytes), -(1 << 20), INT64_MAX,
     "GPU memory that scenes and requests may take; 0 takes a share of what there is"},
    {"texture-budget-bytes", KEY_BYTES, AT(texture_budget_bytes), 0, INT64_MAX,
     "of that, levels of textures resident at once; 0 takes half"},
    {"texture-upload-bytes", KEY_BYTES, AT(texture_upload_bytes), 1 << 16, INT64_MAX,
     "levels of textures brought for one frame of a view in motion"},
    {"texture-upload-ms", KEY_INT, AT(texture_upload_ms), 1, 1000,
     "time that such a frame spends on them"},
    {"texture-compression", KEY_COMPRESSION, AT(texture_compression), 0, 0,
     "colours of textures beyond their budget: on, off, or auto (where the device gains by it)"},
    {"max-upload-bytes", KEY_BYTES, AT(max_upload_bytes), 1 << 10, INT64_MAX,
     "one upload, all its files together"},
    {"decode-memory-bytes", KEY_BYTES, AT(decode_memory_bytes), 64 << 20, INT64_MAX,
     "address space of one decoder beyond the upload itself"},
    {"device", KEY_DEVICE, AT(device), 0, 0,
     "0 chooses; all: every render node; the N-th EGL device, a node, a PCI address, software; a "
     "list"},
    {"workers", KEY_INT, AT(workers), 1, CONFIG_WORKERS_MAX,
     "processes that render; by default one for each device listed"},
    {"auto", KEY_AUTO, AT(automatic), 0, 0,
     "what shadows auto takes: measured (the faster on this device), raster or raytraced"},
    {"self-test", KEY_SELF_TEST, AT(self_test), 0, 0,
     "a scene of known pictures: auto (once a week, by what pictures use) or always (each start)"},
    {"render-timeout-s", KEY_INT, AT(render_timeout_s), 1, 86400, "deadline of one render"},
    {"decode-timeout-s", KEY_INT, AT(decode_timeout_s), 1, 86400,
     "deadline of decoding one upload"},
    {"drain-timeout-s", KEY_INT, AT(drain_timeout_s), 0, 86400,
     "how long a stop waits for renders in flight"},
    {"connections", KEY_INT, AT(connections), 8, 65536, "open connections, all clients together"},
    {"no-warm-up", KEY_BOOL, AT(no_warm_up), 0, 0,
     "do not draw new scenes once, small, while there is nothing else to do"},
    {"warm-at-start", KEY_INT, AT(warm_at_start), 0, WARM_UPS_MAX,
     "so many of the scenes that last gave images are drawn like new ones after a start"},
    {"rest-s", KEY_INT, AT(rest_s), 0, 86400,
     "after so many idle seconds the worker lets go what its last frame did not use; 0: never"},
    {"program-bytes", KEY_BYTES, AT(program_bytes), 0, INT64_MAX,
     "compiled shader programs kept in the state directory; 0 keeps none"},
    {"dump-shaders", KEY_PATH, AT(dump_shaders), 0, 0,
     "existing directory that gets the source of every shader composed; for debugging"},
    {"views", KEY_INT, AT(views), 1, 65536, "views at once, all clients together"},
    {"views-per-client", KEY_INT, AT(views_per_client), 1, 65536, "views of one client address"},
    {"view-idle-s", KEY_INT, AT(view_idle_s), 1, 86400,
     "a view that nobody asks for this long is forgotten"},
    {"log-level", KEY_LEVEL, AT(log_level), 0, 0, "error, warning, info or debug"},
};
enum { KEY_COUNT = sizeof keys / sizeof keys[0] };
static_assert((int)KEY_COUNT <= (int)CONFIG_KEYS_MAX, "config.origins is too small");

static const char *const auto_names[] = {"raster", "measured", "raytraced"};
static const char *const self_test_names[] = {"auto", "always"};
static const char *const level_names[] = {"error", "warning", "info", "debug"};

const char *config_compression_name(enum config_compression compression)
{
    static const char *const names[] = {[CONFIG_COMPRESSION_OFF] = "off",
                                        [CONFIG_COMPRESSION_ON] = "on",
                                        [CONFIG_COMPRESSION_AUTO] = "auto"};
    return names[compression];
}

static void *field_of(struct config *config, const struct key *key)
{
    return (char *)config + key->offset;
}

static size_t capacity_of(const struct key *key)
{
    return key->kind == KEY_PATH ? CONFIG_PATH_BYTES : CONFIG_TEXT_BYTES;
}

/* The table spells names with dashes; file and environment may use underscores. */
static const struct key *key_find(const char *name, size_t length)
{
    for (size_t i = 0; i < KEY_COUNT; i++) {
        const char *known = keys[i].name;
        size_t at = 0;
        while (at < length && known[at] &&
               (tolower((unsigned char)name[at]) == known[at] ||
                (name[at] == '_' && known[at] == '-')))
            at++;
        if (at == length && !known[at])
            return &keys[i];
    }
    return NULL;
}

/* A whole number with an optional binary suffix: 512M, 8GiB, 1024. */
static bool parse_number(const char *text, bool has_suffix, int64_t *value)
{
    char *end;
    errno = 0;
    if (!isdigit((unsigned char)text[0]))
        return false;
    long long number = strtoll(text, &end, 10);
    if (errno != 0 || end == text)
        return false;
    int shift = 0;
    if (has_suffix && *end) {
        static const char letters[] = "KMGT";
        const char *letter = strchr(letters, toupper((unsigned char)*end));
        if (!letter)
            return false;
        shift = 10 * (int)(letter - letters + 1);
        end++;
        if (strcmp(end, "iB") == 0)
            end += 2;
    }
    if (*end || number > (INT64_MAX >> shift))
        return false;
    *value = (int64_t)number << shift;
    return true;
}

static bool parse_bool(const char *text, bool *value)
{
    static const char *const yes[] = {"", "true", "yes", "on", "1"}, *const no[] = {"false", "no",
                                                                                    "off", "0"};
    for (size_t i = 0; i < sizeof yes / sizeof yes[0]; i++)
        if (strcasecmp(text, yes[i]) == 0)
            return *value = true;
    for (size_t i = 0; i < sizeof no / sizeof no[0]; i++)
        if (strcasecmp(text, no[i]) == 0) {
            *value = false;
            return true;
        }
    return false;
}

static bool parse_level(const char *text, enum log_level *level)
{
    for (int i = LOG_ERROR; i <= LOG_DEBUG; i++)
        if (strcmp(text, level_names[i]) == 0) {
            *level = (enum log_level)i;
            return true;
        }
    return false;
}

static bool parse_auto(const char *text, enum config_auto *automatic)
{
    for (int i = CONFIG_AUTO_RASTER; i <= CONFIG_AUTO_RAYTRACED; i++)
        if (strcmp(text, auto_names[i]) == 0) {
            *automatic = (enum config_auto)i;
            return true;
        }
    return false;
}

static bool parse_self_test(const char *text, enum config_self_test *self_test)
{
    for (int i = CONFIG_SELF_TEST_AUTO; i <= CONFIG_SELF_TEST_ALWAYS; i++)
        if (strcmp(text, self_test_names[i]) == 0) {
            *self_test = (enum config_self_test)i;
            return true;
        }
    return false;
}

/* Parses what a switch takes, too. */
static bool parse_compression(const char *text, enum config_compression *compression)
{
    bool is_on = false, is_auto = strcasecmp(text, "auto") == 0;
    if (!is_auto && !parse_bool(text, &is_on))
        return false;
    *compression = is_auto ? CONFIG_COMPRESSION_AUTO
                   : is_on ? CONFIG_COMPRESSION_ON
                           : CONFIG_COMPRESSION_OFF;
    return true;
}

/* A flag that has no value, but "true". */
static bool is_bare(const struct key *key, const char *next)
{
    enum config_compression ignored;
    return key->kind == KEY_BOOL ||
           (key->kind == KEY_COMPRESSION && !(next && parse_compression(next, &ignored)));
}

void config_device(const struct config *config, int worker, char device[CONFIG_TEXT_BYTES])
{
    device_list_get(config->device, worker % device_list_count(config->device), device,
                    CONFIG_TEXT_BYTES);
}

int config_sharers(const struct config *config)
{
    int devices = device_list_count(config->device);
    return (config->workers + devices - 1) / devices;
}

int config_threads(const struct config *config)
{
    return processors_share(config->workers);
}

static bool set_devices(char *devices, size_t bytes, const char *value, struct error *err)
{
    const struct device_list_limits limits = {CONFIG_WORKERS_MAX, bytes};
    if (strcmp(value, "all") == 0)
        return device_list_of_nodes("/dev/dri", &limits, devices, err);
    if (!device_list_check(value, &limits, err))
        return false;
    snprintf(devices, bytes, "%s", *value ? value : "0");
    return true;
}

static bool config_set(struct config *config, const struct key *key, const char *value,
                       const char *origin, struct error *err)
{
    void *field = field_of(config, key);
    bool is_good = true;
    int64_t number = 0;
    switch (key->kind) {
    case KEY_DEVICE:
        if (!set_devices(field, capacity_of(key), value, err))
            return error_wrap(err, "%s (%s)", key->name, origin);
        break;
    case KEY_TEXT:
    case KEY_PATH:
        if (strlen(value) >= capacity_of(key))
            return error_set(err, ERROR_INVALID_REQUEST, "%s (%s): longer than %zu bytes",
                             key->name, origin, capacity_of(key) - 1);
        memcpy(field, value, strlen(value) + 1);
        break;
    case KEY_BYTES:
    case KEY_INT:
        is_good = parse_number(value, key->kind == KEY_BYTES, &number);
        if (is_good && !(number == 0 && key->min < 0) &&
            (number < llabs(key->min) || number > key->max))
            return error_set(err, ERROR_INVALID_REQUEST, "%s (%s): %s is outside [%lld, %lld]",
                             key->name, origin, value, llabs(key->min), (long long)key->max);
        if (is_good && key->kind == KEY_INT)
            *(int *)field = (int)number;
        else if (is_good)
            *(uint64_t *)field = (uint64_t)number;
        break;
    case KEY_BOOL:
        is_good = parse_bool(value, field);
        break;
    case KEY_LEVEL:
        is_good = parse_level(value, field);
        break;
    case KEY_AUTO:
        is_good = parse_auto(value, field);
        break;
    case KEY_COMPRESSION:
        is_good = parse_compression(value, field);
        break;
    case KEY_SELF_TEST:
        is_good = parse_self_test(value, field);
        break;
    }
    if (!is_good)
        return error_set(err, ERROR_INVALID_REQUEST, "%s (%s): '%s' is not a valid value (%s)",
                         key->name, origin, value, key->help);
    config->origins[key - keys] = origin;
    return true;
}

static void default_state_dir(char *path, char **environment)
{
    const char *state_home = NULL, *home = NULL;
    for (char **entry = environment; *entry; entry++) {
        if (strncmp(*entry, "XDG_STATE_HOME=", 15) == 0)
            state_home = *entry + 15;
        if (strncmp(*entry, "HOME=", 5) == 0)
            home = *entry + 5;
    }
    if (geteuid() == 0)
        snprintf(path, CONFIG_PATH_BYTES, "/var/lib/vitrail");
    else if (state_home && *state_home == '/')
        snprintf(path, CONFIG_PATH_BYTES, "%s/vitrail", state_home);
    else
        snprintf(path, CONFIG_PATH_BYTES, "%s/.local/state/vitrail", home && *home ? home : "");
}

static void set_defaults(struct config *config, char **environment)
{
    *config = (struct config){
        .listen = "127.0.0.1:8090",
        .cache_bytes = 4ull << 30,
        .texture_upload_bytes = 16 << 20,
        .texture_upload_ms = 4,
        .texture_compression = CONFIG_COMPRESSION_AUTO,
        .program_bytes = 256 << 20,
        .max_upload_bytes = LIMIT_UPLOAD_BYTES,
        .decode_memory_bytes = 16ull << 30,
        .render_timeout_s = 300,
        .decode_timeout_s = 120,
        .drain_timeout_s = 20,
        .connections = 512,
        .warm_at_start = 2,
        .rest_s = 60,
        .views = 1024,
        .views_per_client = 256,
        .view_idle_s = 900,
        .log_level = LOG_INFO,
        .automatic = CONFIG_AUTO_MEASURED,
        .device = "0",
        .workers = 1,
    };
    default_state_dir(config->state_dir, environment);
    for (size_t i = 0; i < KEY_COUNT; i++)
        config->origins[i] = "default";
}

struct file_reading {
    struct config *config;
    struct error *err;
};

static int read_pair(void *context, const char *section, const char *name, const char *value)
{
    struct file_reading *reading = context;
    const struct key *key = key_find(name, strlen(name));
    if (section[0] && strcmp(section, "vitrail") != 0)
        return (int)error_set(reading->err, ERROR_INVALID_REQUEST, "unknown section [%s]", section);
    if (!key)
        return (int)error_set(reading->err, ERROR_INVALID_REQUEST, "unknown key '%s'", name);
    return (int)config_set(reading->config, key, value, "file", reading->err);
}

static bool read_file(struct config *config, const char *path, struct error *err)
{
    struct file_reading reading = {config, err};
    FILE *file = fopen(path, "re");
    if (!file)
        return error_set(err, ERROR_INVALID_REQUEST, "config file '%s': %s", path, strerror(errno));
    int line = ini_parse_file(file, read_pair, &reading);
    fclose(file);
    if (line == 0)
        return true;
    error_set(err, ERROR_INVALID_REQUEST, "not a line of the form key = value");
    return error_wrap(err, "config file '%s', line %d", path, line);
}

/* VITRAIL_CONFIG, which is read before, and what clients read, who may start us. */
static bool is_for_others(const char *entry)
{
    static const char *const names[] = {"VITRAIL_CONFIG=", "VITRAIL_SERVER=", "VITRAIL_URL="};
    bool is = false;
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        is |= strncmp(entry, names[i], strlen(names[i])) == 0;
    return is;
}

static bool read_environment(struct config *config, char **environment, struct error *err)
{
    for (char **entry = environment; *entry; entry++) {
        const char *equals = strchr(*entry, '=');
        if (!equals || strncmp(*entry, "VITRAIL_", 8) != 0 || is_for_others(*entry))
            continue;
        const struct key *key = key_find(*entry + 8, (size_t)(equals - *entry) - 8);
        if (!key)
            return error_set(err, ERROR_INVALID_REQUEST, "environment: unknown variable %.*s",
                             (int)(equals - *entry), *entry);
        if (!config_set(config, key, equals + 1, "environment", err))
            return false;
    }
    return true;
}

/* Splits --name=value and --name value; sets *value to NULL for a flag that stands alone. */
static const char *flag_value(int argc, char **argv, int index, size_t *name_length)
{
    const char *flag = argv[index] + 2;
    const char *equals = strchr(flag, '=');
    *name_length = equals ? (size_t)(equals - flag) : strlen(flag);
    if (equals)
        return equals + 1;
    bool has_next = index + 1 < argc && strncmp(argv[index + 1], "--", 2) != 0;
    return has_next ? argv[index + 1] : NULL;
}

static bool is_action(const char *flag, enum config_action *action)
{
    static const struct {
        const char *flag;
        enum config_action action;
    } actions[] = {{"--check-config", CONFIG_CHECK},
                   {"--print-config", CONFIG_PRINT},
                   {"--version", CONFIG_VERSION},
                   {"--help", CONFIG_HELP},
                   {"-h", CONFIG_HELP}};
    for (size_t i = 0; i < sizeof actions / sizeof actions[0]; i++)
        if (strcmp(flag, actions[i].flag) == 0) {
            *action = actions[i].action;
            return true;
        }
    return false;
}

/* --backup FILE, which is an action with a value. */
static bool set_backup(struct config *config, const char *file, struct error *err)
{
    if (!*file || strlen(file) >= sizeof config->backup_file)
        return error_set(err, ERROR_INVALID_REQUEST, "--backup: not the name of a file");
    config->action = CONFIG_BACKUP;
    memcpy(config->backup_file, file, strlen(file) + 1);
    return true;
}

/* Two passes over the flags: the first finds --config and the action, the second sets values. */
static bool read_flags(struct config *config, int argc, char **argv, const char **file,
                       bool is_first, struct error *err)
{
    for (int i = 1; i < argc; i++) {
        if (is_action(argv[i], &config->action))
            continue;
        if (strncmp(argv[i], "--", 2) != 0)
            return error_set(err, ERROR_INVALID_REQUEST,
                             "unexpected argument '%s' (--help lists the flags)", argv[i]);
        bool is_joined = strchr(argv[i], '=') != NULL;
        size_t length;
        const char *value = flag_value(argc, argv, i, &length);
        const char *name = argv[i] + 2;
        bool is_file = length == 6 && strncmp(name, "config", 6) == 0;
        bool is_backup = length == 6 && strncmp(name, "backup", 6) == 0;
        const struct key *key = is_file || is_backup ? NULL : key_find(name, length);
        if (!is_file && !is_backup && !key)
            return error_set(err, ERROR_INVALID_REQUEST,
                             "unknown flag '%s' (--help lists the flags)", argv[i]);
        if (key && !is_joined && is_bare(key, argv[i + 1])) {
            if (!is_first && !config_set(config, key, "true", "flag", err))
                return false;
            continue;
        }
        if (!value)
            return error_set(err, ERROR_INVALID_REQUEST, "flag '%s' needs a value", argv[i]);
        if (is_file)
            *file = value;
        bool is_taken = is_file || (key && is_first) ||
                        (is_backup ? set_backup(config, value, err)
                                   : config_set(config, key, value, "flag", err));
        if (!is_taken)
            return false;
        i += !is_joined;
    }
    return true;
}

/* Splits HOST:PORT or [HOST]:PORT and resolves it; names other than localhost are not looked up. */
static bool resolve_listen(struct config *config, struct error *err)
{
    const char *colon = strrchr(config->listen, ':');
    if (!colon || colon == config->listen || !colon[1])
        return error_set(err, ERROR_INVALID_REQUEST, "listen: '%s' is not HOST:PORT",
                         config->listen);
    const char *host = config->listen;
    size_t length = (size_t)(colon - host);
    if (host[0] == '[' && length >= 2 && host[length - 1] == ']') {
        host++;
        length -= 2;
    }
    memcpy(config->listen_host, host, length);
    config->listen_host[length] = '\0';
    int64_t port;
    if (!parse_number(colon + 1, false, &port) || port > 65535)
        return error_set(err, ERROR_INVALID_REQUEST, "listen: '%s' is not a port", colon + 1);
    const char *numeric =
        strcmp(config->listen_host, "localhost") == 0 ? "127.0.0.1" : config->listen_host;
    struct sockaddr_in v4 = {.sin_family = AF_INET, .sin_port = htons((uint16_t)port)};
    struct sockaddr_in6 v6 = {.sin6_family = AF_INET6, .sin6_port = htons((uint16_t)port)};
    if (inet_pton(AF_INET, numeric, &v4.sin_addr) == 1) {
        memcpy(&config->address, &v4, sizeof v4);
        config->is_loopback = (ntohl(v4.sin_addr.s_addr) >> 24) == 127;
    } else if (inet_pton(AF_INET6, numeric, &v6.sin6_addr) == 1) {
        memcpy(&config->address, &v6, sizeof v6);
        config->is_loopback = IN6_IS_ADDR_LOOPBACK(&v6.sin6_addr);
    } else {
        return error_set(err, ERROR_INVALID_REQUEST,
                         "listen: '%s' is neither an address nor localhost", config->listen_host);
    }
    if (!config->is_loopback && !config->allow_remote)
        return error_set(
            err, ERROR_INVALID_REQUEST,
            "listen: %s can be reached from other machines; add --allow-remote if a proxy or "
            "firewall stands in front (docs/reference/http.md)",
            config->listen_host);
    return true;
}

/* path: of CONFIG_PATH_BYTES. */
static bool make_absolute(char *path, const char *key, struct error *err)
{
    char here[CONFIG_PATH_BYTES / 2], relative[CONFIG_PATH_BYTES];
    if (path[0] == '/')
        return true;
    memcpy(relative, path, sizeof relative);
    if (!relative[0] || !getcwd(here, sizeof here) ||
        snprintf(path, CONFIG_PATH_BYTES, "%s/%s", here, relative) >= CONFIG_PATH_BYTES)
        return error_set(err, ERROR_INVALID_REQUEST, "%s: '%s' is not usable as a path", key,
                         relative);
    return true;
}

/* path: of CONFIG_PATH_BYTES; "" where the key is not set. */
static bool check_directory(char *path, const char *key, struct error *err)
{
    struct stat status;
    if (!path[0])
        return true;
    if (!make_absolute(path, key, err))
        return false;
    if (stat(path, &status) != 0)
        return error_set(err, ERROR_INVALID_REQUEST, "%s: '%s': %s", key, path, strerror(errno));
    if (!S_ISDIR(status.st_mode) || access(path, W_OK) != 0)
        return error_set(err, ERROR_INVALID_REQUEST,
                         "%s: '%s' is not a directory that can be written to", key, path);
    return true;
}

/* One worker for each device, where their number is not given. */
static bool settle_workers(struct config *config, struct error *err)
{
    int devices = device_list_count(config->device);
    bool is_given = false;
    for (size_t i = 0; i < KEY_COUNT; i++)
        if (keys[i].offset == AT(workers))
            is_given = strcmp(config->origins[i], "default") != 0;
    if (!is_given)
        config->workers = devices;
    return config->workers >= devices ||
           error_set(err, ERROR_INVALID_REQUEST, "workers: %d for the %d devices of '%s'",
                     config->workers, devices, config->device);
}

bool config_load(struct config *config, int argc, char **argv, char **environment,
                 struct error *err)
{
    set_defaults(config, environment);
    const char *file = NULL;
    for (char **entry = environment; *entry; entry++)
        if (strncmp(*entry, "VITRAIL_CONFIG=", 15) == 0)
            file = *entry + 15;
    if (!read_flags(config, argc, argv, &file, true, err))
        return false;
    if (config->action == CONFIG_HELP || config->action == CONFIG_VERSION)
        return true;
    if ((file && !read_file(config, file, err)) || !read_environment(config, environment, err) ||
        !read_flags(config, argc, argv, &file, false, err))
        return false;
    return settle_workers(config, err) && make_absolute(config->state_dir, "state-dir", err) &&
           check_directory(config->dump_shaders, "dump-shaders", err) &&
           check_directory(config->job_dir, "job-dir", err) && resolve_listen(config, err);
}

static void print_value(const struct config *config, const struct key *key, FILE *out)
{
    const void *field = (const char *)config + key->offset;
    switch (key->kind) {
    case KEY_DEVICE:
    case KEY_TEXT:
    case KEY_PATH:
        fprintf(out, "%s", (const char *)field);
        break;
    case KEY_BYTES:
        fprintf(out, "%llu", (unsigned long long)*(const uint64_t *)field);
        break;
    case KEY_INT:
        fprintf(out, "%d", *(const int *)field);
        break;
    case KEY_BOOL:
        fprintf(out, "%s", *(const bool *)field ? "true" : "false");
        break;
    case KEY_AUTO:
        fprintf(out, "%s", auto_names[*(const enum config_auto *)field]);
        break;
    case KEY_SELF_TEST:
        fprintf(out, "%s", self_test_names[*(const enum config_self_test *)field]);
        break;
    case KEY_COMPRESSION:
        fprintf(out, "%s", config_compression_name(*(const enum config_compression *)field));
        break;
    case KEY_LEVEL:
        fprintf(out, "%s", level_names[*(const enum log_level *)field]);
        break;
    }
}

void config_print(const struct config *config, FILE *out)
{
    fprintf(out, "[vitrail]\n");
    for (size_t i = 0; i < KEY_COUNT; i++) {
        fprintf(out, "; %s\n%s = ", config->origins[i], keys[i].name);
        print_value(config, &keys[i], out);
        fprintf(out, "\n");
    }
}

void config_print_help(FILE *out)
{
    fprintf(
        out,
        "usage: vitraild [flags]\n\n"
        "Each flag is also a key of the INI file and, in capitals with underscores, a variable\n"
        "VITRAIL_... of the environment. Flags win over the environment, which wins over the "
        "file.\n\n"
        "  --config FILE          read FILE first\n");
    for (size_t i = 0; i < KEY_COUNT; i++)
        fprintf(out, "  --%-20s %s\n", keys[i].name, keys[i].help);
    fprintf(out, "  --backup FILE          copy the database of jobs to FILE, beside a running\n"
                 "                         daemon or without one, and exit\n"
                 "  --check-config         check all settings and exit\n"
                 "  --print-config         print all settings with their origin and exit\n"
                 "  --version, --help\n\n"
                 "Sizes take K, M, G, T (binary). Exit status: 0 stopped as asked, 1 failed, 2 bad "
                 "configuration.\n");
}
