#include "unit.h"

#include <stdarg.h>
#include <stdio.h>

#include "normal.h"

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

static int out_of_memory(hs_unit *unit) {
    return refuse(unit, HS_FAILED, "there is no memory left");
}

/* ---- resources
 * ----------------------------------------------------------------------------------------------------------
 */

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
    const char *between =
        length && (folder[length - 1] == '/' || folder[length - 1] == '\\') ? "" : "/";
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

/* ---- one tangential direction, or two
 * ------------------------------------------------------------------------------------- */

/* Tangential load [N] and displacement [m] in a direction: of the contact, and of its drive. */
typedef struct hs_tangential {
    double load, displacement, drive;
} hs_tangential;

static hs_tangential in_units(const hs_units *units, double load, double displacement,
                              double compliance) {
    hs_tangential found = {load * units->load, displacement * units->displacement, 0.0};
    found.drive = found.displacement + compliance * found.load;
    return found;
}

static hs_tangential tangential_of(const hs_state *state, int direction) {
    const hs_units *units = &state->line.contact->units;
    const hs_plane *plane = state->plane;
    if (!plane)
        return in_units(units, state->line.tangential_load, state->line.displacement, COMPLIANCE);
    return direction
               ? in_units(units, plane->tangential_load.y, plane->displacement.y, COMPLIANCE_Y)
               : in_units(units, plane->tangential_load.x, plane->displacement.x, COMPLIANCE);
}

static int is_held_at_limit(const hs_state *state) {
    const hs_plane *plane = state->plane;
    return plane ? plane->excess.x != 0.0 || plane->excess.y != 0.0 : state->line.excess != 0.0;
}

/* A component of the stiffness [N/m] on the side of the last step: xx, xy, yx, yy. */
static int stiffness(hs_unit *unit, int component, double *value) {
    const hs_state *state = unit->now.state;
    double each[4] = {0.0, 0.0, 0.0, 0.0};
    if (!state->plane)
        each[0] = hs_slopes_of(state, unit->now.beginning).tangential;
    else if (hs_stiffness_matrix(state, unit->now.way, each) != HS_OK)
        return out_of_memory(unit);
    *value = each[component];
    return HS_DONE;
}

static int same_start(hs_unit *unit) {
    unit->now.state = hs_state_copy(unit->start);
    if (!unit->now.state) return out_of_memory(unit);
    const hs_line *memory = &unit->now.state->line;
    const hs_units *units = &memory->contact->units;
    unit->now.input[0] = NORMAL_CONTROL == HS_LOAD ? memory->normal_load * units->load
                                                   : memory->approach * units->length;
    for (int k = 0; k < unit->directions; ++k) {
        hs_tangential found = tangential_of(unit->now.state, k);
        unit->now.input[1 + k] = TANGENTIAL_CONTROL == HS_LOAD ? found.load : found.drive;
    }
    memset(unit->now.rate, 0, sizeof unit->now.rate);
    unit->now.way[0] = unit->now.way[1] = 0.0;
    unit->now.beginning = memory->approach * units->length;
    unit->now.factor = 1.0;
    unit->now.time = 0.0;
    unit->now.mode = HS_INSTANTIATED;
    return HS_DONE;
}

/* Have the coefficients be a factor times those of the start. */
static int scale_friction(hs_unit *unit, double factor) {
    int64_t count = unit->start->line.contact->count;
    double *scaled = unit->friction + count;
    for (int64_t i = 0; i < count; ++i) scaled[i] = factor * unit->friction[i];
    if (hs_set_friction(unit->now.state, scaled, &unit->drive) != HS_OK) return out_of_memory(unit);
    unit->now.factor = factor;
    return HS_DONE;
}

/* resources/contact.bin is a state by `hs_state_write`. resources/curve.bin is added for a contact
 * of patches, in doubles: rows, patches; approaches [m] (rows + 1); contact areas [m²] (rows + 1);
 * first touches [m], ascending (patches). */
static hs_unit *not_made(hs_unit *unit, char *message, size_t size, const char *format, ...) {
    va_list values;
    va_start(values, format);
    vsnprintf(message, size, format, values);
    va_end(values);
    hs_unit_free(unit);
    return NULL;
}

/* Whether the table of a contact of patches is whole. */
static int has_table(hs_unit *unit, size_t length) {
    if (!unit->table || length < 2 * sizeof(double)) return 0;
    unit->rows = (int64_t)unit->table[0];
    unit->patches = (int64_t)unit->table[1];
    return unit->rows > 0 && unit->patches > 0 &&
           length == sizeof(double) * (size_t)(4 + 2 * unit->rows + unit->patches);
}

hs_unit *hs_unit_new(const char *resources, char *message, size_t size) {
    hs_unit *unit = (hs_unit *)calloc(1, sizeof *unit);
    size_t length = 0;
    const char *why = "resources/contact.bin cannot be read";
    if (!unit) return not_made(unit, message, size, "there is no memory left");
    unit->drive.tolerance = TOLERANCE;
    unit->drive.compliance[0] = COMPLIANCE;
    unit->drive.compliance[1] = COMPLIANCE_Y;
    unit->drive.saturate = SATURATE;
    unit->drive.threads = 1;
    void *bytes = content_of(resources, "contact.bin", &length);
    if (bytes && hs_state_read(bytes, length, NULL, &unit->start, &why) != HS_OK)
        unit->start = NULL;
    free(bytes);
    if (!unit->start)
        return not_made(unit, message, size,
                        "%s; expected the unit unpacked as a whole, with its resources in %s", why,
                        resources);
    if (PATCHES) {
        unit->table = (double *)content_of(resources, "curve.bin", &length);
        if (!has_table(unit, length))
            return not_made(unit, message, size,
                            "resources/curve.bin cannot be read, or is damaged");
    }
    unit->directions = unit->start->plane ? 2 : 1;
    const hs_line *line = &unit->start->line;
    const hs_contact *contact = line->contact;
    unit->friction = (double *)malloc(2 * (size_t)contact->count * sizeof(double));
    for (int64_t g = 0; unit->friction && g < contact->groups; ++g)
        for (int64_t i = contact->first[g]; i < contact->first[g + 1]; ++i)
            unit->friction[contact->order[i]] = line->friction[g];
    if (!unit->friction || same_start(unit) != HS_DONE)
        return not_made(unit, message, size, "there is no memory left");
    return unit;
}

void hs_unit_free(hs_unit *unit) {
    if (!unit) return;
    hs_state_free(unit->now.state);
    hs_state_free(unit->start);
    free(unit->friction);
    free(unit->table);
    free(unit->numbers);
    free(unit);
}

int hs_unit_reset(hs_unit *unit) {
    hs_state_free(unit->now.state);
    unit->now.state = NULL;
    return same_start(unit);
}

/* ---- steps
 * ----------------------------------------------------------------------------------------------------------------
 */

static unsigned inputs_of(const hs_unit *unit) { return 1u + (unsigned)unit->directions; }

int hs_unit_set(hs_unit *unit, unsigned reference, double value) {
    if (!(fabs(value) <= LARGEST_SIZE))
        return refuse(unit, HS_REFUSED,
                      "an input is %g; expected a finite number, at most %g in size", value,
                      LARGEST_SIZE);
    if (reference < inputs_of(unit)) {
        if (reference == V_PRESCRIBED_NORMAL && NORMAL_CONTROL == HS_LOAD && value < 0.0)
            return refuse(unit, HS_REFUSED, "the normal load is %g N; expected 0 or more", value);
        unit->now.input[reference] = value;
        unit->now.rate[reference] = 0.0;
    } else if (reference == V_FRICTION_FACTOR) {
        if (value < 0.0)
            return refuse(unit, HS_REFUSED, "the friction factor is %g; expected 0 or more", value);
        if (value == unit->now.factor) return HS_DONE;
        if (unit->now.mode != HS_STEPPING) {
            /* from the start, so that the order in which values are set makes no difference */
            hs_moment kept = unit->now;
            hs_state_free(kept.state);
            if (same_start(unit) != HS_DONE) return HS_FAILED;
            kept.state = unit->now.state;
            unit->now = kept;
        }
        return scale_friction(unit, value);
    } else {
        return refuse(unit, HS_FAILED, "variable %u is no input and no parameter", reference);
    }
    return HS_DONE;
}

int hs_unit_set_rate(hs_unit *unit, unsigned reference, double value) {
    if (reference >= inputs_of(unit))
        return refuse(unit, HS_FAILED, "variable %u is no input", reference);
    if (!isfinite(value))
        return refuse(unit, HS_REFUSED, "a derivative is %g; expected a finite number", value);
    unit->now.rate[reference] = value;
    return HS_DONE;
}

/* Advance to the inputs; nothing is changed by a step that is refused. */
static int advance(hs_unit *unit, const double *to, hs_refusal *refusal) {
    hs_state *before = unit->now.state;
    if (!before->plane)
        return hs_step(before, NORMAL_CONTROL, to[0], TANGENTIAL_CONTROL, to[1], &unit->drive,
                       refusal);
    hs_path path = {to[0],
                    1.0,
                    {to[1], to[2]},
                    {1.0, 1.0},
                    1,
                    0,
                    NORMAL_CONTROL,
                    {TANGENTIAL_CONTROL, TANGENTIAL_CONTROL},
                    0,
                    NAN,
                    NAN};
    hs_state *after = hs_advance_along(before, &path, &unit->drive, refusal);
    if (!after) return (int)refusal->status;
    unit->now.way[0] = after->plane->displacement.x - before->plane->displacement.x;
    unit->now.way[1] = after->plane->displacement.y - before->plane->displacement.y;
    unit->now.state = after;
    hs_state_free(before);
    return HS_OK;
}

int hs_unit_step(hs_unit *unit, double time, double length) {
    hs_refusal refusal;
    hs_moment *now = &unit->now;
    if (!(fabs(time) <= LARGEST_SIZE) || !(length > 0.0) || !(fabs(time + length) <= LARGEST_SIZE))
        return refuse(unit, HS_REFUSED,
                      "the step is from %g s by %g s; expected finite times, and a length above 0",
                      time, length);
    double to[MOST_INPUTS];
    for (unsigned k = 0; k < inputs_of(unit); ++k) {
        to[k] = now->rate[k] == 0.0 ? now->input[k] : now->input[k] + now->rate[k] * length;
        if (!(fabs(to[k]) <= LARGEST_SIZE) || (k == 0 && NORMAL_CONTROL == HS_LOAD && to[k] < 0.0))
            return refuse(unit, HS_REFUSED,
                          "an input is %g; expected a finite number, at most %g in size, and no "
                          "negative normal load",
                          to[k], LARGEST_SIZE);
    }
    double normal = to[0];
    if (normal > (NORMAL_CONTROL == HS_LOAD ? LARGEST_LOAD : LARGEST_APPROACH))
        return refuse(unit, HS_REFUSED, "%s of %g is beyond the normal curves; expected at most %g",
                      NORMAL_CONTROL == HS_LOAD ? "a normal load [N]" : "an approach [m]", normal,
                      NORMAL_CONTROL == HS_LOAD ? LARGEST_LOAD : LARGEST_APPROACH);
    double beginning = now->state->line.approach;
    int status = advance(unit, to, &refusal);
    if (status == HS_BEYOND_LIMIT)
        return refuse(unit, HS_REFUSED,
                      "a tangential load of %g N is beyond the friction limit of %g N, and the "
                      "contact would slide; expected "
                      "less, or a unit that was made to saturate",
                      refusal.request, refusal.limit);
    if (status != HS_OK) return out_of_memory(unit);
    /* a ramp of both loads begins where the contact touches */
    if (NORMAL_CONTROL == HS_LOAD && TANGENTIAL_CONTROL == HS_LOAD && beginning < 0.0)
        beginning = 0.0;
    now->beginning = beginning * now->state->line.contact->units.length;
    memset(now->rate, 0, sizeof now->rate);
    now->time = time + length;
    return HS_DONE;
}

/* ---- outputs
 * --------------------------------------------------------------------------------------------------------------
 */

static double area_at(const hs_unit *unit, double approach) {
    const double *at = unit->table + 2, *area = at + unit->rows + 1;
    int64_t last = unit->rows, row = hs_count_touching(at, last + 1, approach);
    if (row == 0) return area[0];
    if (row > last) return area[last];
    return area[row - 1] +
           (area[row] - area[row - 1]) * ((approach - at[row - 1]) / (at[row] - at[row - 1]));
}

/* Share of the contact area outside the stick radii, as `slip_shares` has it. */
static int slipping_share(hs_unit *unit, double *value) {
    const hs_line *memory = &unit->now.state->line;
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
    double total_load[2], total_displacement[2];
    hs_totals totals;
    hs_rows rows;
    memset(&rows, 0, sizeof rows);
    rows.columns = columns;
    rows.asperity = asperity;
    rows.totals = &totals;
    rows.contact_radius = radius;
    rows.stick_radius = stick;
    rows.normal_load = stick + n;
    rows.tangential_load = stick + 2 * n; /* a vector of each in a plane */
    rows.total_tangential_load = total_load;
    rows.total_displacement = total_displacement;
    rows.slip_state = (int8_t *)(asperity + n);
    if (hs_read(unit->now.state, &rows, 0) != HS_OK) return out_of_memory(unit);
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
    return reference == V_CONTACT_COUNT ? HS_INTEGER
           : reference == V_SATURATED   ? HS_BOOLEAN
                                        : HS_REAL;
}

int hs_unit_get(hs_unit *unit, unsigned reference, double *value) {
    const hs_line *memory = &unit->now.state->line;
    const hs_units *units = &memory->contact->units;
    hs_tangential along = tangential_of(unit->now.state, 0);
    switch (reference) {
    case V_PRESCRIBED_NORMAL:
        *value = unit->now.input[0];
        break;
    case V_PRESCRIBED_TANGENTIAL:
        *value = unit->now.input[1];
        break;
    case V_FRICTION_FACTOR:
        *value = unit->now.factor;
        break;
    case V_NORMAL_LOAD:
        *value = memory->normal_load * units->load;
        break;
    case V_TANGENTIAL_LOAD:
        *value = along.load;
        break;
    case V_APPROACH:
        *value = memory->approach * units->length;
        break;
    case V_TANGENTIAL_DISPLACEMENT:
        *value = along.displacement;
        break;
    case V_DRIVE_DISPLACEMENT:
        *value = along.drive;
        break;
    case V_PRESCRIBED_TANGENTIAL_Y:
        *value = unit->now.input[2];
        break;
    case V_TANGENTIAL_LOAD_Y:
        *value = tangential_of(unit->now.state, 1).load;
        break;
    case V_TANGENTIAL_DISPLACEMENT_Y:
        *value = tangential_of(unit->now.state, 1).displacement;
        break;
    case V_DRIVE_DISPLACEMENT_Y:
        *value = tangential_of(unit->now.state, 1).drive;
        break;
    case V_TANGENTIAL_STIFFNESS:
        return stiffness(unit, 0, value);
    case V_TANGENTIAL_STIFFNESS_XY:
        return stiffness(unit, 1, value);
    case V_TANGENTIAL_STIFFNESS_YY:
        return stiffness(unit, 3, value);
    case V_COUPLING_STIFFNESS:
        *value = hs_slopes_of(unit->now.state, unit->now.beginning).coupling;
        break;
    case V_NORMAL_STIFFNESS:
        *value = hs_slopes_of(unit->now.state, unit->now.beginning).normal;
        break;
    case V_DISSIPATED_ENERGY:
        *value = memory->dissipated * units->energy;
        break;
    case V_SLIPPING_SHARE:
        return slipping_share(unit, value);
    case V_CONTACT_COUNT:
        *value =
            (double)(PATCHES ? hs_count_touching(unit->table + 4 + 2 * unit->rows, unit->patches,
                                                 memory->approach * units->length)
                             : hs_contact_count(unit->now.state));
        break;
    case V_SATURATED:
        *value = is_held_at_limit(unit->now.state);
        break;
    case V_TIME:
        *value = unit->now.time;
        break;
    default:
        return refuse(unit, HS_FAILED, "variable %u does not exist", reference);
    }
    return HS_DONE;
}

int hs_unit_derivative(hs_unit *unit, unsigned unknown, unsigned known, double *value) {
    if (unit->directions > 1)
        return refuse(unit, HS_REFUSED,
                      "derivatives are not given in two tangential directions; expected the "
                      "outputs of stiffness");
    const hs_slopes slopes = hs_slopes_of(unit->now.state, unit->now.beginning);
    const char *open = "the contact slides or does not touch, so that loads do not say where it "
                       "is: derivatives are not "
                       "defined here";
    double d, u;
    if (known == V_PRESCRIBED_NORMAL) {
        if (NORMAL_CONTROL == HS_LOAD && !(slopes.normal > 0.0))
            return refuse(unit, HS_REFUSED, "%s", open);
        d = NORMAL_CONTROL == HS_LOAD ? 1.0 / slopes.normal : 1.0;
    } else if (known == V_PRESCRIBED_TANGENTIAL) {
        d = 0.0;
    } else {
        return refuse(unit, HS_REFUSED,
                      "derivatives are given in the two inputs; variable %u is none", known);
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
    case V_NORMAL_LOAD:
        *value = NORMAL_CONTROL == HS_LOAD ? (d != 0.0) : slopes.normal * d;
        break;
    case V_TANGENTIAL_LOAD:
        *value = load;
        break;
    case V_APPROACH:
        *value = d;
        break;
    case V_TANGENTIAL_DISPLACEMENT:
        *value = u;
        break;
    case V_DRIVE_DISPLACEMENT:
        *value = TANGENTIAL_CONTROL == HS_LOAD ? u + COMPLIANCE * load : input;
        break;
    default:
        return refuse(
            unit, HS_REFUSED,
            "derivatives are given of loads, approach and displacements; variable %u is none",
            unknown);
    }
    return HS_DONE;
}

/* ---- moments
 * --------------------------------------------------------------------------------------------------------------
 */

void hs_moment_free(hs_moment *saved) {
    if (!saved) return;
    hs_state_free(saved->state);
    free(saved);
}

int hs_unit_save(hs_unit *unit, hs_moment **saved) {
    hs_state *copy = hs_state_copy(unit->now.state);
    hs_moment *made = *saved ? *saved : (hs_moment *)calloc(1, sizeof *made);
    if (!copy || !made) {
        hs_state_free(copy);
        if (!*saved) free(made);
        return out_of_memory(unit);
    }
    hs_state_free(made->state);
    *made = unit->now;
    made->state = copy;
    *saved = made;
    return HS_DONE;
}

int hs_unit_restore(hs_unit *unit, const hs_moment *saved) {
    hs_state *copy = hs_state_copy(saved->state);
    if (!copy) return out_of_memory(unit);
    hs_state_free(unit->now.state);
    unit->now = *saved;
    unit->now.state = copy;
    return HS_DONE;
}

/* The bytes are: the token of the unit, all of the moment but its state, a checksum (FNV-1a) of
 * both, and the state. */
#define NUMBERS (sizeof(hs_moment) - offsetof(hs_moment, input))
static const char token[] = MODEL_TOKEN;

static void checksum(const unsigned char *bytes, size_t size, unsigned char *sum) {
    uint64_t found = 14695981039346656037u;
    for (size_t i = 0; i < size; ++i) found = (found ^ bytes[i]) * 1099511628211u;
    memcpy(sum, &found, sizeof found);
}

size_t hs_moment_size(const hs_moment *saved) {
    return sizeof token + NUMBERS + sizeof(uint64_t) + hs_state_size(saved->state);
}

int hs_moment_write(hs_unit *unit, const hs_moment *saved, void *bytes, size_t size) {
    unsigned char *at = (unsigned char *)bytes;
    if (size < hs_moment_size(saved))
        return refuse(unit, HS_REFUSED, "there is no room for the state in %zu bytes", size);
    memcpy(at, token, sizeof token);
    memcpy(at + sizeof token, (const char *)saved + offsetof(hs_moment, input), NUMBERS);
    size_t head = sizeof token + NUMBERS;
    checksum(at, head, at + head);
    head += sizeof(uint64_t);
    if (hs_state_write(saved->state, at + head, hs_state_size(saved->state)) != HS_OK)
        return out_of_memory(unit);
    return HS_DONE;
}

int hs_moment_read(hs_unit *unit, const void *bytes, size_t size, hs_moment **saved) {
    const unsigned char *at = (const unsigned char *)bytes;
    unsigned char sum[sizeof(uint64_t)];
    const char *why = NULL;
    size_t head = sizeof token + NUMBERS;
    if (size <= head + sizeof sum || memcmp(at, token, sizeof token) != 0)
        return refuse(
            unit, HS_REFUSED,
            "the bytes are no state of this unit; expected those that it has written itself");
    checksum(at, head, sum);
    if (memcmp(sum, at + head, sizeof sum) != 0)
        return refuse(unit, HS_REFUSED, "the bytes of the state are damaged");
    hs_moment *made = (hs_moment *)calloc(1, sizeof *made);
    if (!made) return out_of_memory(unit);
    head += sizeof sum;
    int status = hs_state_read(at + head, size - head, unit->start, &made->state, &why);
    if (status != HS_OK) {
        hs_moment_free(made);
        if (status == HS_OUT_OF_MEMORY) return out_of_memory(unit);
        return refuse(unit, HS_REFUSED, "the state cannot be read: %s", why);
    }
    memcpy((char *)made + offsetof(hs_moment, input), at + sizeof token, NUMBERS);
    hs_moment_free(*saved);
    *saved = made;
    return HS_DONE;
}
