/** Short names for the generated types. */
import type { components } from './schema'

type Schemas = components['schemas']

export type Experiment = Schemas['Experiment']
export type ExperimentState = Experiment['state']
export type Run = Schemas['Run']
export type RunDetail = Schemas['RunDetail']
export type RunState = Run['state']
export type RunEvent = Schemas['RunEvent']
export type Checkpoint = Schemas['Checkpoint']
export type Diagnosis = Schemas['Diagnosis']
export type Estimate = Schemas['Estimate']
export type Series = Schemas['Series']
export type Curves = Schemas['Curves']
export type Comparison = Schemas['Comparison']
export type Preset = Schemas['Preset']
export type Status = Schemas['Status']
export type LiveSettings = Schemas['LiveSettings']
export type LiveState = Schemas['LiveState']
export type TrainingConfig = Experiment['training']
