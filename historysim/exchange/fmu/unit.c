#include "unit.h"

#include <stdarg.h>
#include <stdio.h>

#include "internal.h"

#if defined(_WIN32)
#include <windows.h>
#endif

static int refuse(hs_unit *unit, int answer, const char *format, ...) {
    va_list values;
    va_start(values, format);
    vsnprintf(unit->message, sizeof unit->message, format, values);
    va_end(values);
    return answer;
}

static int out_of_memory(hs_unit *unit) { return refuse(unit, HS_FAILED, "there is no memory left"); }

/* ---- resources ---------------------------------------------------------------------------------------------------------- */

static FILE *opened(const char *path) {
#if defined(_WIN32)
    wchar_t wide[4096];
    if (!MultiByteToWideChar(CP_UTF8, 0, path, -1, wide, 4096)) return NULL;
    return _wfopen(wide, L"rb");
#else
    return fopen(path, "rb");
#endif
}

/* The bytes of a file in a folder; NULL where it cannot be read. */
static void *content_of(const char *folder, const char *name, size_t *size) {
    size_t length = strlen(folder);
    char *path = (char *)malloc(length + strlen(name) + 2);
    unsigned char *bytes = NULL;
    if (!path) return NULL;
    const char *between = length && (folder[length - 1] == '/' || folder[length - 1] == '\\') ? "" : "/";
    sprintf(path, "%s%s%s", folder, between, name);
    FILE *file = opened(path);
    free(path);
    if (!file) return NULL;
    if (fseek(file, 0, SEEK_END) == 0) {
        long end = ftell(file);
        if (end > 0 && fseek(file, 0, SEEK_SET) == 0) bytes = (unsigned char *)malloc((size_t)end);
        *size = end > 0 ? (size_t)end : 0;
        if (bytes && fread(bytes, 1, *size, file) != *size) {
            free(bytes);
            bytes = NULL;
        }
    }
    fclose(file);
    return bytes;
}

static int same_start(hs_unit *unit) {
    unit->now.memory = hs_memory_copy(unit->start);
    if (!unit->now.memory || hs_memory_join(unit->now.memory) != HS_OK) return out_of_memory(unit);
    const hs_memory *memory = unit->now.memory;
    const hs_units *units = &memory->contact->units;
    unit->now.input[0] = NORMAL_CONTROL == HS_LOAD ? memory->normal_load * units->load : memory->approach * units->length;
    unit->now.input[1] = TANGENTIAL_CONTROL == HS_LOAD
                             ? memory->tangential_load * units->load
                             : memory->displacement * units->displacement + COMPLIANCE * (memory->tangential_load * units->load);
    unit->now.rate[0] = unit->now.rate[1] = 0.0;
    unit->now.beginning = memory->approach * units->length;
    unit->now.factor = 1.0;
    unit->now.time = 0.0;
    unit->now.mode = HS_INSTANTIATED;
    return HS_DONE;
}

/* Have the coefficients be a factor times those of the start. */
static int scale_friction(hs_unit *unit, double factor) {
    int64_t count = unit->start->contact->count;
    double *scaled = unit->friction + count;
    for (int64_t i = 0; i < count; ++i) scaled[i] = factor * unit->friction[i];
    if (hs_set_friction(unit->now.memory, scaled, &unit->drive) != HS_OK) return out_of_memory(unit);
    unit->now.factor = factor;
    return HS_DONE;
}

/* resources/contact.bin is a memory by `hs_memory_write`. resources/curve.bin stands beside it for a contact of patches, in
 * doubles: rows, patches; approaches [m] (rows + 1); contact areas [m²] (rows + 1); first touches [m], ascending (patches). */
hs_unit *hs_unit_new(const char *resources, char *message, size_t size) {
    hs_unit *unit = (hs_unit *)calloc(1, sizeof *unit);
    size_t length = 0;
    const char *why = "resources/contact.bin cannot be read";
    hs_memory *made = NULL;
    if (!unit) {
        snprintf(message, size, "there is no memory left");
        return NULL;
    }
    unit->drive.tolerance = TOLERANCE;
    unit->drive.compliance = COMPLIANCE;
    unit->drive.saturate = SATURATE;
    unit->drive.threads = 1;
    void *bytes = content_of(resources, "contact.bin", &length);
    if (bytes && hs_memory_read(bytes, length, NULL, &made, &why) == HS_OK) unit->start = made;
    free(bytes);
    if (!unit->start) {
        snprintf(message, size, "%s; expected the unit unpacked as a whole, with its resources in %s", why, resources);
        hs_unit_free(unit);
        return NULL;
    }
    if (PATCHES) {
        unit->table = (double *)content_of(resources, "curve.bin", &length);
        int whole = unit->table && length >= 2 * sizeof(double);
        if (whole) {
            unit->rows = (int64_t)unit->table[0];
            unit->patches = (int64_t)unit->table[1];
            whole = unit->rows > 0 && unit->patches > 0 &&
                    length == sizeof(double) * (size_t)(4 + 2 * unit->rows + unit->patches);
        }
        if (!whole) {
            snprintf(message, size, "resources/curve.bin cannot be read, or is damaged");
            hs_unit_free(unit);
            return NULL;
        }
    }
    const hs_contact *contact = unit->start->contact;
    unit->friction = (double *)malloc(2 * (size_t)contact->count * sizeof(double));
    for (int64_t g = 0; unit->friction && g < contact->groups; ++g)
        for (int64_t i = contact->first[g]; i < contact->first[g + 1]; ++i)
            unit->friction[contact->order[i]] = unit->start->friction[g];
    if (!unit->friction || same_start(unit) != HS_DONE) {
        snprintf(message, size, "there is no memory left");
        hs_unit_free(unit);
        return NULL;
    }
    return unit;
}

void hs_unit_free(hs_unit *unit) {
    if (!unit) return;
    hs_memory_free(unit->now.memory);
    hs_memory_free(unit->start);
    free(unit->friction);
    free(unit->table);
    free(unit->numbers);
    free(unit);
}

int hs_unit_reset(hs_unit *unit) {
    hs_memory_free(unit->now.memory);
    unit->now.memory = NULL;
    return same_start(unit);
}

/* ---- steps ---------------------------------------------------------------------------------------------------------------- */

int hs_unit_set(hs_unit *unit, unsigned reference, double value) {
    if (!(fabs(value) <= LARGEST_SIZE))
        return refuse(unit, HS_REFUSED, "an input is %g; expected a finite number, at most %g in size", value, LARGEST_SIZE);
    if (reference == V_PRESCRIBED_NORMAL) {
        if (NORMAL_CONTROL == HS_LOAD && value < 0.0)
            return refuse(unit, HS_REFUSED, "the normal load is %g N; expected 0 or more", value);
        unit->now.input[0] = value;
        unit->now.rate[0] = 0.0;
    } else if (reference == V_PRESCRIBED_TANGENTIAL) {
        unit->now.input[1] = value;
        unit->now.rate[1] = 0.0;
    } else if (reference == V_FRICTION_FACTOR) {
        if (value < 0.0) return refuse(unit, HS_REFUSED, "the friction factor is %g; expected 0 or more", value);
        if (value == unit->now.factor) return HS_DONE;
        if (unit->now.mode != HS_STEPPING) {
            /* from the start, so that the order in which values are set makes no difference */
            hs_moment kept = unit->now;
            hs_memory_free(kept.memory);
            if (same_start(unit) != HS_DONE) return HS_FAILED;
            kept.memory = unit->now.memory;
            unit->now = kept;
        }
        return scale_friction(unit, value);
    } else {
        return refuse(unit, HS_FAILED, "variable %u is no input and no parameter", reference);
    }
    return HS_DONE;
}

int hs_unit_set_rate(hs_unit *unit, unsigned reference, double value) {
    if (reference != V_PRESCRIBED_NORMAL && reference != V_PRESCRIBED_TANGENTIAL)
        return refuse(unit, HS_FAILED, "variable %u is no input", reference);
    if (!isfinite(value)) return refuse(unit, HS_REFUSED, "a derivative is %g; expected a finite number", value);
    unit->now.rate[reference == V_PRESCRIBED_TANGENTIAL] = value;
    return HS_DONE;
}

int hs_unit_step(hs_unit *unit, double time, double length) {
    hs_refusal refusal;
    hs_moment *now = &unit->now;
    if (!(fabs(time) <= LARGEST_SIZE) || !(length > 0.0) || !(fabs(time + length) <= LARGEST_SIZE))
        return refuse(unit, HS_REFUSED, "the step is from %g s by %g s; expected finite times, and a length above 0", time,
                      length);
    double normal = now->rate[0] == 0.0 ? now->input[0] : now->input[0] + now->rate[0] * length;
    double tangential = now->rate[1] == 0.0 ? now->input[1] : now->input[1] + now->rate[1] * length;
    if (!(fabs(normal) <= LARGEST_SIZE) || !(fabs(tangential) <= LARGEST_SIZE) || (NORMAL_CONTROL == HS_LOAD && normal < 0.0))
        return refuse(unit, HS_REFUSED, "the inputs go to %g and %g; expected finite numbers, at most %g in size, and no negative normal load",
                      normal, tangential, LARGEST_SIZE);
    if (normal > (NORMAL_CONTROL == HS_LOAD ? LARGEST_LOAD : LARGEST_APPROACH))
        return refuse(unit, HS_REFUSED, "%s of %g is beyond the normal curves; expected at most %g",
                      NORMAL_CONTROL == HS_LOAD ? "a normal load [N]" : "an approach [m]", normal,
                      NORMAL_CONTROL == HS_LOAD ? LARGEST_LOAD : LARGEST_APPROACH);
    double beginning = now->memory->approach;
    int status = hs_step(now->memory, NORMAL_CONTROL, normal, TANGENTIAL_CONTROL, tangential, &unit->drive, &refusal);
    if (status == HS_BEYOND_LIMIT)
        return refuse(unit, HS_REFUSED,
                      "a tangential load of %g N is beyond the friction limit of %g N, and the contact would slide; expected "
                      "less, or a unit that was made to saturate",
                      refusal.request, refusal.limit);
    if (status != HS_OK) return out_of_memory(unit);
    /* a ramp of both loads begins where the contact touches */
    if (NORMAL_CONTROL == HS_LOAD && TANGENTIAL_CONTROL == HS_LOAD && beginning < 0.0) beginning = 0.0;
    now->beginning = beginning * now->memory->contact->units.length;
    now->rate[0] = now->rate[1] = 0.0;
    now->time = time + length;
    return HS_DONE;
}

/* ---- outputs -------------------------------------------------------------------------------------------------------------- */

static double area_at(const hs_unit *unit, double approach) {
    const double *at = unit->table + 2, *area = at + unit->rows + 1;
    int64_t last = unit->rows, row = hs_touching(at, last + 1, approach);
    if (row == 0) return area[0];
    if (row > last) return area[last];
    return area[row - 1] + (area[row] - area[row - 1]) * ((approach - at[row - 1]) / (at[row] - at[row - 1]));
}

/* Share of the contact area outside the stick radii, as `slip_shares` has it. */
static int slipping_share(hs_unit *unit, double *value) {
    const hs_memory *memory = unit->now.memory;
    int64_t columns = PATCHES ? 1 : memory->contact->count;
    size_t n = (size_t)columns;
    *value = 0.0;
    if (memory->depth[0] == 0) return HS_DONE;
    if (!unit->numbers) {
        unit->numbers = (double *)malloc(n * (5 * sizeof(double) + sizeof(int64_t) + 1));
        if (!unit->numbers) return out_of_memory(unit);
    }
    double *radius = unit->numbers, *stick = radius + n;
    int64_t *asperity = (int64_t *)(stick + 4 * n);
    for (int64_t i = 0; i < columns; ++i) asperity[i] = i;
    hs_totals totals;
    hs_rows rows;
    memset(&rows, 0, sizeof rows);
    rows.columns = columns;
    rows.asperity = asperity;
    rows.totals = &totals;
    rows.contact_radius = radius;
    rows.stick_radius = stick;
    rows.normal_load = stick + n;
    rows.tangential_load = stick + 2 * n;
    rows.slip_state = (int8_t *)(asperity + n);
    if (hs_read(memory, &rows, 0) != HS_OK) return out_of_memory(unit);
    double whole = 0.0, sticks = 0.0;
    if (PATCHES) {
        /* on the first element, which touches at 0, areas are proportional to approaches */
        double part = radius[0] > 0.0 ? stick[0] / radius[0] : 0.0;
        whole = area_at(unit, totals.approach);
        sticks = area_at(unit, totals.approach * (part * part));
    } else {
        for (int64_t i = 0; i < columns; ++i) {
            whole += radius[i] * radius[i];
            sticks += stick[i] * stick[i];
        }
    }
    if (whole > 0.0) *value = (whole - sticks) / whole;
    return HS_DONE;
}

enum hs_type hs_unit_type(unsigned reference) {
    return reference == V_CONTACT_COUNT ? HS_INTEGER : reference == V_SATURATED ? HS_BOOLEAN : HS_REAL;
}

int hs_unit_get(hs_unit *unit, unsigned reference, double *value) {
    const hs_memory *memory = unit->now.memory;
    const hs_units *units = &memory->contact->units;
    double load = memory->tangential_load * units->load, displacement = memory->displacement * units->displacement;
    switch (reference) {
    case V_PRESCRIBED_NORMAL: *value = unit->now.input[0]; break;
    case V_PRESCRIBED_TANGENTIAL: *value = unit->now.input[1]; break;
    case V_FRICTION_FACTOR: *value = unit->now.factor; break;
    case V_NORMAL_LOAD: *value = memory->normal_load * units->load; break;
    case V_TANGENTIAL_LOAD: *value = load; break;
    case V_APPROACH: *value = memory->approach * units->length; break;
    case V_TANGENTIAL_DISPLACEMENT: *value = displacement; break;
    case V_DRIVE_DISPLACEMENT: *value = displacement + COMPLIANCE * load; break;
    case V_TANGENTIAL_STIFFNESS: *value = hs_slopes_of(memory, unit->now.beginning).tangential; break;
    case V_COUPLING_STIFFNESS: *value = hs_slopes_of(memory, unit->now.beginning).coupling; break;
    case V_NORMAL_STIFFNESS: *value = hs_slopes_of(memory, unit->now.beginning).normal; break;
    case V_DISSIPATED_ENERGY: *value = memory->dissipated * units->energy; break;
    case V_SLIPPING_SHARE: return slipping_share(unit, value);
    case V_CONTACT_COUNT:
        *value = (double)(PATCHES ? hs_touching(unit->table + 4 + 2 * unit->rows, unit->patches, memory->approach * units->length)
                                  : hs_contact_count(memory));
        break;
    case V_SATURATED: *value = memory->excess != 0.0; break;
    case V_TIME: *value = unit->now.time; break;
    default: return refuse(unit, HS_FAILED, "variable %u does not exist", reference);
    }
    return HS_DONE;
}

int hs_unit_derivative(hs_unit *unit, unsigned unknown, unsigned known, double *value) {
    const hs_slopes slopes = hs_slopes_of(unit->now.memory, unit->now.beginning);
    const char *open = "the contact slides or does not touch, so that loads do not say where it is: derivatives are not "
                       "defined here";
    double d, u;
    if (known == V_PRESCRIBED_NORMAL) {
        if (NORMAL_CONTROL == HS_LOAD && !(slopes.normal > 0.0)) return refuse(unit, HS_REFUSED, "%s", open);
        d = NORMAL_CONTROL == HS_LOAD ? 1.0 / slopes.normal : 1.0;
    } else if (known == V_PRESCRIBED_TANGENTIAL) {
        d = 0.0;
    } else {
        return refuse(unit, HS_REFUSED, "derivatives are given in the two inputs; variable %u is none", known);
    }
    double input = known == V_PRESCRIBED_TANGENTIAL ? 1.0 : 0.0;
    if (TANGENTIAL_CONTROL == HS_LOAD) {
        if (!(slopes.tangential > 0.0)) return refuse(unit, HS_REFUSED, "%s", open);
        u = (input - slopes.coupling * d) / slopes.tangential;
    } else {
        u = (input - COMPLIANCE * slopes.coupling * d) / (1.0 + COMPLIANCE * slopes.tangential);
    }
    double load = slopes.tangential * u + slopes.coupling * d;
    if (TANGENTIAL_CONTROL == HS_LOAD) load = input;
    switch (unknown) {
    case V_NORMAL_LOAD: *value = NORMAL_CONTROL == HS_LOAD ? (d != 0.0) : slopes.normal * d; break;
    case V_TANGENTIAL_LOAD: *value = load; break;
    case V_APPROACH: *value = d; break;
    case V_TANGENTIAL_DISPLACEMENT: *value = u; break;
    case V_DRIVE_DISPLACEMENT: *value = TANGENTIAL_CONTROL == HS_LOAD ? u + COMPLIANCE * load : input; break;
    default:
        return refuse(unit, HS_REFUSED, "derivatives are given of loads, approach and displacements; variable %u is none",
                      unknown);
    }
    return HS_DONE;
}

/* ---- moments -------------------------------------------------------------------------------------------------------------- */

void hs_moment_free(hs_moment *saved) {
    if (!saved) return;
    hs_memory_free(saved->memory);
    free(saved);
}

int hs_unit_save(hs_unit *unit, hs_moment **saved) {
    hs_memory *copy = hs_memory_copy(unit->now.memory);
    hs_moment *made = *saved ? *saved : (hs_moment *)calloc(1, sizeof *made);
    if (!copy || !made) {
        hs_memory_free(copy);
        if (!*saved) free(made);
        return out_of_memory(unit);
    }
    hs_memory_free(made->memory);
    *made = unit->now;
    made->memory = copy;
    *saved = made;
    return HS_DONE;
}

int hs_unit_restore(hs_unit *unit, const hs_moment *saved) {
    hs_memory *copy = hs_memory_copy(saved->memory);
    if (!copy || hs_memory_join(copy) != HS_OK) {
        hs_memory_free(copy);
        return out_of_memory(unit);
    }
    hs_memory_free(unit->now.memory);
    unit->now = *saved;
    unit->now.memory = copy;
    return HS_DONE;
}

/* The bytes are: the token of the unit, all numbers of the moment, a checksum (FNV-1a) of both, and the memory. */
#define NUMBERS 8
static const char token[] = MODEL_TOKEN;

static void checksum(const unsigned char *bytes, size_t size, unsigned char *sum) {
    uint64_t found = 14695981039346656037u;
    for (size_t i = 0; i < size; ++i) found = (found ^ bytes[i]) * 1099511628211u;
    memcpy(sum, &found, sizeof found);
}

size_t hs_moment_size(const hs_moment *saved) {
    return sizeof token + (NUMBERS + 1) * sizeof(double) + hs_memory_size(saved->memory);
}

int hs_moment_write(hs_unit *unit, const hs_moment *saved, void *bytes, size_t size) {
    unsigned char *at = (unsigned char *)bytes;
    double numbers[NUMBERS] = {saved->input[0], saved->input[1],  saved->rate[0], saved->rate[1],
                               saved->factor,   saved->beginning, saved->time,    (double)saved->mode};
    if (size < hs_moment_size(saved)) return refuse(unit, HS_REFUSED, "there is no room for the state in %zu bytes", size);
    memcpy(at, token, sizeof token);
    memcpy(at + sizeof token, numbers, sizeof numbers);
    size_t head = sizeof token + sizeof numbers;
    checksum(at, head, at + head);
    head += sizeof(uint64_t);
    if (hs_memory_write(saved->memory, at + head, hs_memory_size(saved->memory)) != HS_OK) return out_of_memory(unit);
    return HS_DONE;
}

int hs_moment_read(hs_unit *unit, const void *bytes, size_t size, hs_moment **saved) {
    const unsigned char *at = (const unsigned char *)bytes;
    unsigned char sum[sizeof(uint64_t)];
    double numbers[NUMBERS];
    const char *why = NULL;
    size_t head = sizeof token + sizeof numbers;
    if (size <= head + sizeof sum || memcmp(at, token, sizeof token) != 0)
        return refuse(unit, HS_REFUSED, "the bytes are no state of this unit; expected those that it has written itself");
    checksum(at, head, sum);
    if (memcmp(sum, at + head, sizeof sum) != 0) return refuse(unit, HS_REFUSED, "the bytes of the state are damaged");
    memcpy(numbers, at + sizeof token, sizeof numbers);
    hs_moment *made = (hs_moment *)calloc(1, sizeof *made);
    if (!made) return out_of_memory(unit);
    head += sizeof sum;
    int status = hs_memory_read(at + head, size - head, unit->start, &made->memory, &why);
    if (status != HS_OK) {
        hs_moment_free(made);
        if (status == HS_OUT_OF_MEMORY) return out_of_memory(unit);
        return refuse(unit, HS_REFUSED, "the state cannot be read: %s", why);
    }
    for (int k = 0; k < 2; ++k) {
        made->input[k] = numbers[k];
        made->rate[k] = numbers[2 + k];
    }
    made->factor = numbers[4];
    made->beginning = numbers[5];
    made->time = numbers[6];
    made->mode = (int64_t)numbers[7];
    hs_moment_free(*saved);
    *saved = made;
    return HS_DONE;
}
