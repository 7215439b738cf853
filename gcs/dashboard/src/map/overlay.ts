/**
 * Everything that moves, drawn on a canvas above the map. Not as the map's own layers: those come from a worker tile by
 * tile, and a drone that crosses from one tile to the next can be missing for a moment. A drone is never missing here.
 */

import type { Map as MapView } from "maplibre-gl";

import { bestAlternatives, moveEndM, whyLines, type UavExplanation } from "../core/explanation";
import { frameOf, pixelsAtZoom0, toLngLat } from "../core/geo";
import { color } from "../core/theme";
import type { Trails } from "../core/trails";
import type { CampaignStatic, Pair, PlanView, UserView, VehicleView } from "../core/types";
import { bigness } from "./bigness";
import { Glide } from "./glide";
import { Sheet } from "./sheet";
import { droneLook, namesAt, placed, type DroneLook } from "./scene";

export interface Moving {
  campaign: CampaignStatic | null;
  vehicles: readonly VehicleView[];
  trails: Trails;
  plans: readonly PlanView[];
  selected: number | null;
  live: boolean;
  why: UavExplanation | null; // of the chosen drone
  users: readonly UserView[];
}

const LOOK_COLORS: Record<DroneLook, string> = { normal: "drone", stale: "drone-stale", caution: "caution", warning: "warning" };
const PICK_PX = 22;
const SAME_PX = 9; // drones that near to each other share one name: on the same pad they would cover theirs
const MANY = 20; // drones: dashes cost more than they tell
const font = (): string => `700 ${14 * bigness()}px 'Inter Variable', system-ui, 'DejaVu Sans', sans-serif`;

export class Overlay {
  /** What changes with a report or when the map moves, and what changes with every picture. */
  private readonly ways = new Sheet();
  private readonly drones = new Sheet();
  private moving: Moving = { campaign: null, vehicles: [], trails: new Map(), plans: [], selected: null, live: false, why: null, users: [] };
  private readonly glide = new Glide();
  private readonly still = matchMedia("(prefers-reduced-motion: reduce)");
  private frame = 0;
  private pictures = 0;

  constructor(private readonly map: MapView) {
    this.drones.canvas.classList.add("drones");
    map.getCanvasContainer().append(this.ways.canvas, this.drones.canvas);
    map.on("render", () => this.drawBoth());
  }

  show(moving: Moving): void {
    this.moving = moving;
    const places = moving.vehicles.flatMap(({ system_id, lat_deg, lon_deg }): [number, Pair][] =>
      lat_deg === null || lon_deg === null ? [] : [[system_id, [lon_deg, lat_deg]]]);
    this.glide.report(new Map(places), performance.now());
    this.drawBoth();
    if (this.frame === 0) this.goOn();
  }

  /** A picture with every frame while somebody glides. */
  private goOn(): void {
    this.frame = 0;
    if (this.still.matches || !this.glide.moving(performance.now())) return;
    this.frame = requestAnimationFrame(() => {
      this.drawDrones();
      this.goOn();
    });
  }

  /** The drone at a place on the screen, if any. */
  pick(x: number, y: number): number | null {
    const near = this.placed()
      .map(({ vehicle, at }) => ({ id: vehicle.system_id, distance: Math.hypot(at[0] - x, at[1] - y) }))
      .sort((a, b) => a.distance - b.distance)[0];
    return near !== undefined && near.distance <= PICK_PX * bigness() ? near.id : null;
  }

  private placed(): { vehicle: VehicleView; at: Pair }[] {
    return this.moving.vehicles.flatMap((vehicle) => {
      if (vehicle.lat_deg === null || vehicle.lon_deg === null) return [];
      const place = this.still.matches ? undefined : this.glide.at(vehicle.system_id, performance.now());
      const { x, y } = this.map.project(place ?? [vehicle.lon_deg, vehicle.lat_deg]);
      return [{ vehicle, at: [x, y] as Pair }];
    });
  }

  private pixel(pointM: Pair): Pair {
    if (this.moving.campaign === null) return [-1, -1];
    const { x, y } = this.map.project(toLngLat(frameOf(this.moving.campaign), pointM));
    return [x, y];
  }

  private drawBoth(): void {
    this.drawWays();
    this.drawDrones();
  }

  private drawWays(): void {
    const context = this.ways.cleared(this.map);
    const { campaign, trails, plans, live } = this.moving;
    if (context === null || campaign === null) return;
    for (const trail of trails.values()) this.line(context, trail, "trail", 1.4, []);
    if (!live) return;
    for (const plan of plans) this.line(context, plan.path_m, "plan", 2.6, plans.length > MANY ? [] : [6, 4]);
    this.drawWhy(context, campaign);
  }

  /** Counted, so that it can be told how smooth it is. */
  private drawDrones(): void {
    const context = this.drones.cleared(this.map);
    const { campaign, selected, live } = this.moving;
    if (context === null) return;
    const drones = this.placed();
    const reachPx = campaign === null ? 0 : pixelsAtZoom0(campaign.serving_radius_m, campaign.south_west_deg[0]) * 2 ** this.map.getZoom();
    for (const { vehicle, at } of drones)
      if (vehicle.landed !== "on_ground") drawReach(context, at, reachPx, vehicle.system_id === selected, drones.length > MANY);
    const names = namesAt(drones.map(({ vehicle, at }) => ({ id: vehicle.system_id, at })), SAME_PX * bigness());
    for (const { vehicle, at } of drones) drawDrone(context, at, vehicle, droneLook(vehicle, live), vehicle.system_id === selected, names.get(vehicle.system_id) ?? null);
    this.pictures += 1;
    this.drones.canvas.dataset["drawn"] = `${this.pictures}`;
  }

  /** From the chosen drone: lines to whom it attends to, its plan, and its alternatives with what they would cost. */
  private drawWhy(context: CanvasRenderingContext2D, campaign: CampaignStatic): void {
    const { why, users, vehicles, plans } = this.moving;
    const drone = placed(vehicles).find((vehicle) => vehicle.system_id === why?.system_id);
    if (why === null || drone === undefined || plans.length === 0) return;
    const here: Pair = [drone.east_m, drone.north_m];
    for (const { toM, strength, expectedM } of whyLines(why, users)) {
      context.globalAlpha = 0.35 + 0.65 * strength;
      this.line(context, [here, toM], "why", 1 + 4 * strength, []);
      if (expectedM !== null) this.expected(context, toM, expectedM);
    }
    context.globalAlpha = 1;
    const from = plans.find((plan) => plan.system_id === why.system_id)?.path_m[0] ?? here; // where the slot began
    this.line(context, [from, ...why.path_m], "plan", 1.6, [2, 5]);
    for (const other of bestAlternatives(why)) {
      const end = moveEndM(from, other, campaign.slot_s);
      this.line(context, [from, end], "drone-stale", 1.6, [3, 3]);
      drawName(context, `+${other.worse_by.toFixed(2)}`, color("map-ground"), this.pixel(end));
    }
  }

  /** From where a user is to where the policy expects him when the slot ends. */
  private expected(context: CanvasRenderingContext2D, from: Pair, to: Pair): void {
    this.line(context, [from, to], "why", 1.4, [2, 3]);
    context.beginPath();
    context.arc(...this.pixel(to), 4.5 * bigness(), 0, 2 * Math.PI);
    context.lineWidth = 1.6 * bigness();
    context.stroke();
  }

  private line(context: CanvasRenderingContext2D, pointsM: readonly Pair[], token: string, width: number, dash: number[]): void {
    context.beginPath();
    for (const point of pointsM) context.lineTo(...this.pixel(point));
    context.lineWidth = width * bigness();
    context.strokeStyle = color(token);
    context.setLineDash(dash);
    context.stroke();
    context.setLineDash([]);
  }
}

function drawReach(context: CanvasRenderingContext2D, [x, y]: Pair, radius: number, chosen: boolean, plain: boolean): void {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.fillStyle = context.strokeStyle = color("reach");
  context.globalAlpha = chosen ? 0.18 : 0.1;
  if (chosen || !plain) context.fill();
  context.globalAlpha = plain && !chosen ? 0.6 : 1;
  context.lineWidth = chosen ? 2.4 : plain ? 0.8 : 1.4;
  context.setLineDash(plain && !chosen ? [] : [7, 5]);
  context.stroke();
  context.globalAlpha = 1;
  context.setLineDash([]);
}

/** An arrow along the direction of travel; hollow when it is not known to be there any more. */
function drawDrone(context: CanvasRenderingContext2D, [x, y]: Pair, vehicle: VehicleView, look: DroneLook, chosen: boolean, name: string | null): void {
  const [paint, ground, size] = [color(LOOK_COLORS[look]), color("map-ground"), (chosen ? 1.25 : 1) * bigness()];
  context.save();
  context.translate(x, y);
  context.save();
  context.rotate((vehicle.heading_deg * Math.PI) / 180);
  context.scale(size, size);
  context.beginPath();
  for (const [dx, dy] of [[0, -13], [10, 11], [0, 6], [-10, 11]] as const) context.lineTo(dx, dy);
  context.closePath();
  context.lineJoin = "round";
  context.lineWidth = look === "stale" ? 3 : 4;
  context.strokeStyle = look === "stale" ? paint : ground;
  context.stroke();
  context.fillStyle = look === "stale" ? ground : paint;
  context.fill();
  context.restore();
  if (name !== null) drawName(context, name, ground);
  context.restore();
}

function drawName(context: CanvasRenderingContext2D, name: string, ground: string, [x, y]: Pair = [13 * bigness(), -11 * bigness()]): void {
  context.font = font();
  context.lineJoin = "round";
  context.lineWidth = 4;
  context.strokeStyle = ground;
  context.strokeText(name, x, y);
  context.fillStyle = color("ink");
  context.fillText(name, x, y);
}
