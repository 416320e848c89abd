/* SPDX-License-Identifier: MIT */
/* Configuration of the daemon: flags over environment (VITRAIL_*) over an INI file over defaults.
 * Thread: main. */
#ifndef VITRAIL_SERVER_BASE_CONFIG_H
#define VITRAIL_SERVER_BASE_CONFIG_H

#include <netinet/in.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "protocol/error.h"
#include "server/base/log.h"

enum { CONFIG_PATH_BYTES = 4096, CONFIG_TEXT_BYTES = 512, CONFIG_KEYS_MAX = 48 };
enum { CONFIG_WORKERS_MAX = 16 };

/* Scenes that wait to be warmed up; above it the least wanted one is dropped. */
enum { WARM_UPS_MAX = 4 };

/* What `shadows: auto` goes by; in the order of enum auto_policy. */
enum config_auto { CONFIG_AUTO_RASTER, CONFIG_AUTO_MEASURED, CONFIG_AUTO_RAYTRACED };

enum config_action {
    CONFIG_SERVE,
    CONFIG_CHECK,
    CONFIG_PRINT,
    CONFIG_BACKUP,
    CONFIG_VERSION,
    CONFIG_HELP
};

/* In the order of enum renderer_selftest, after its first. */
enum config_self_test { CONFIG_SELF_TEST_AUTO, CONFIG_SELF_TEST_ALWAYS };

enum config_compression {
    CONFIG_COMPRESSION_OFF,
    CONFIG_COMPRESSION_ON,   /* before any level is withheld */
    CONFIG_COMPRESSION_AUTO, /* where the device gains by it, before many are */
};

/* Fixed size, so it is handed down by const pointer and freed by nobody. */
struct config {
    enum config_action action;
    char backup_file[CONFIG_PATH_BYTES]; /* of CONFIG_BACKUP */
    char listen[CONFIG_TEXT_BYTES];      /* HOST:PORT as given */
    char listen_host[CONFIG_TEXT_BYTES]; /* its host, without brackets */
    struct sockaddr_storage address;     /* resolved; port 0 = the system chooses */
    bool is_loopback;
    bool allow_remote;
    /* Comma-separated names accepted in Host beside the loopback ones. */
    char allow_host[CONFIG_TEXT_BYTES];
    char allow_origin[CONFIG_TEXT_BYTES]; /* comma-separated origins whose pages may use the API */
    char state_dir[CONFIG_PATH_BYTES];
    char job_dir[CONFIG_PATH_BYTES]; /* below which jobs may write their results; "" = nowhere */
    int job_retention_days;          /* jobs that ended are forgotten so long after; 0: never */
    uint64_t job_results_bytes;      /* of all jobs in the state directory; 0: no limit */
    uint64_t cache_bytes;            /* of scenes mapped by the worker */
    uint64_t gpu_budget_bytes;       /* 0 = a share of what there is */
    uint64_t texture_budget_bytes;   /* 0 = half of the GPU's */
    uint64_t texture_upload_bytes;   /* of one frame in motion */
    int texture_upload_ms;           /* likewise */
    enum config_compression texture_compression; /* of colours beyond the budget */
    uint64_t max_upload_bytes;                   /* of one upload, all files */
    uint64_t decode_memory_bytes;                /* of one decoder */
    int workers;                    /* processes that render, [1, CONFIG_WORKERS_MAX] */
    char device[CONFIG_TEXT_BYTES]; /* what gl_device_parse takes, separated by commas; "0" chooses
                                     */
    bool no_warm_up;                /* stored scenes are not drawn before someone asks */
    int warm_at_start;              /* stored scenes drawn after a start, [0, WARM_UPS_MAX] */
    int rest_s;                     /* idle until structures are let go; 0: they stay */
    uint64_t program_bytes; /* of compiled programs in the state directory; 0: none are kept */
    char dump_shaders[CONFIG_PATH_BYTES]; /* existing directory for composed shaders; "" = none */
    enum config_auto automatic;
    enum config_self_test self_test; /* when the device draws the scene of the self-test */
    int render_timeout_s, decode_timeout_s, drain_timeout_s;
    int connections; /* at most, all clients together */
    int views, views_per_client, view_idle_s;
    enum log_level log_level;
    /* Per key: "default", "file", "environment", "flag"; static. */
    const char *origins[CONFIG_KEYS_MAX];
};

/* Reads flags, the environment and the file that --config or VITRAIL_CONFIG names. Unknown keys,
 * bad values and a public address without allow-remote are errors (ERROR_INVALID_REQUEST) that name
 * key and origin. */
MUST_CHECK bool config_load(struct config *config, int argc, char **argv, char **environment,
                            struct error *err);

/* "off", "on" or "auto". */
const char *config_compression_name(enum config_compression compression);

/* What a worker is asked to open, 0 for the first: those that are listed take turns. */
void config_device(const struct config *config, int worker, char device[CONFIG_TEXT_BYTES]);
/* How many workers share a device at most. */
int config_sharers(const struct config *config);
/* How many threads each worker may keep busy. */
int config_threads(const struct config *config);

/* As an INI file, with the origin of every value. */
void config_print(const struct config *config, FILE *out);
void config_print_help(FILE *out);

#endif
