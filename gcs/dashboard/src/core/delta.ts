/** The newest snapshot, from the one before and what changed. Vehicles that did not change stay the same objects. */

import type { CampaignView, DeltaMessage, SnapshotMessage, VehicleView } from "./types";

export function merged(before: SnapshotMessage, delta: DeltaMessage): SnapshotMessage {
  const changes = new Map(delta.vehicles.map((one) => [one["system_id"], one]));
  const campaign = before.campaign;
  return {
    ...before,
    ...(delta.changed as Partial<SnapshotMessage>),
    vehicles: before.vehicles.map((vehicle) => withChange(vehicle, changes.get(vehicle.system_id))),
    campaign: campaign === null ? null : { ...campaign, users: null, ...(delta.campaign as Partial<CampaignView>) },
  };
}

const withChange = (vehicle: VehicleView, change: Record<string, unknown> | undefined): VehicleView =>
  change === undefined ? vehicle : { ...vehicle, ...(change as Partial<VehicleView>) };
