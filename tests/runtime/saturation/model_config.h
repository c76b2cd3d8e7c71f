#define MODEL_IDENTIFIER saturation
#define MODEL_GUID "{saturation}"
#define N_X 2
#define N_U 2
#define N_P 6
#define N_D 0
#define N_W 2
#define N_Y 1
#define N_G 4
#define DEFAULT_TOLERANCE 1e-6
#include "value_references.h"
